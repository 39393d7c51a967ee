"""Damage to the bytes of a file, as of a bad disk, a bad editor and somebody who tries."""

ODD = (
    b"", b"\0", b"\xff", b'"', b"'", b",", b";", b"\n", b"\r", b"1e999", b"-", b"nan", b"null", b"{", b"[" * 99,
    b"9" * 400, b"\xe2\x82", "¥".encode(), b"/", b"PK\x03\x04", b"true", b"\x00" * 64, b"&a [*a]", b"-0.0", b"604800",
    b"!!python/object:x ", b"1e-320", b"M98 P\"x.g\"", b"G1 E1e9\n", b"\x1b[2J", b"0x10", b"inf", b": ", b"- ",
    b"m", b"=1+1", b"\x80\x04", b"uid",
)  # fmt: skip


def mutated(content, rng):
    """Bytes replaced, removed, doubled, cut off, or numbers changed."""
    content = bytearray(content)
    for _ in range(rng.choice((1, 1, 2, 4, 12))):
        at, length = rng.randrange(len(content) + 1), rng.choice((0, 1, 1, 2, 4, 8, 100))
        kind = rng.randrange(7)
        if kind == 0:
            content[at : at + length] = rng.choice(ODD)
        elif kind == 1:
            content[at : at + length] = rng.randbytes(length)
        elif kind == 2:
            del content[at : at + length]
        elif kind == 3:
            content[at:at] = content[at : at + length]
        elif kind == 4:
            content[at : at + 4] = rng.choice(
                (b"\xff" * 4, b"\0" * 4, b"\x80\0\0\0", b"\0\0\0\x80", b"\xff\xff\xff\x7f")
            )
        elif kind == 5 and content:
            content[at % len(content)] ^= 1 << rng.randrange(8)
        elif rng.random() < 0.2:
            del content[at:]
    return bytes(content)

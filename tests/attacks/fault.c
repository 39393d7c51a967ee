/* Kills its process at the n-th call that changes a file, before it, after half of its bytes, or after it.
 *
 * Loaded before the C library (LD_PRELOAD); fault_arm(n, how) begins to count, n = 0 only counts. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <signal.h>
#include <sys/types.h>
#include <unistd.h>

static long at, seen;
static int mode; /* 0 before, 1 after half, 2 after */
static volatile int armed;

void fault_arm(long n, int how) { at = n; mode = how; seen = 0; armed = 1; }
long fault_seen(void) { armed = 0; return seen; }

static int here(void) { return armed && ++seen == at; }
static void end(void) { kill(getpid(), SIGKILL); }

#define REAL(name) static __typeof__(name) *real; if (!real) real = (__typeof__(name) *)dlsym(RTLD_NEXT, #name)
#define WHOLE(call) do { int now = here(); if (now && mode < 2) end(); __typeof__(call) result = (call); \
    if (now) end(); return result; } while (0)
#define BYTES(call, half) do { int now = here(); if (now && mode == 0) end(); \
    if (now && mode == 1) { (void)!(half); end(); } __typeof__(call) result = (call); if (now) end(); return result; } while (0)

ssize_t pwrite64(int fd, const void *data, size_t n, off64_t to)
{ REAL(pwrite64); BYTES(real(fd, data, n, to), real(fd, data, n / 2, to)); }
ssize_t pwrite(int fd, const void *data, size_t n, off_t to)
{ REAL(pwrite); BYTES(real(fd, data, n, to), real(fd, data, n / 2, to)); }
ssize_t write(int fd, const void *data, size_t n) { REAL(write); BYTES(real(fd, data, n), real(fd, data, n / 2)); }
int fsync(int fd) { REAL(fsync); WHOLE(real(fd)); }
int fdatasync(int fd) { REAL(fdatasync); WHOLE(real(fd)); }
int ftruncate64(int fd, off64_t n) { REAL(ftruncate64); WHOLE(real(fd, n)); }
int rename(const char *from, const char *to) { REAL(rename); WHOLE(real(from, to)); }
int link(const char *from, const char *to) { REAL(link); WHOLE(real(from, to)); }
int unlink(const char *path) { REAL(unlink); WHOLE(real(path)); }

"""Pages of HTML, read without a browser."""

from html.parser import HTMLParser

VOID = {"meta", "input", "link", "img", "br"}


class HtmlPage(HTMLParser):
    """Content of a page: tags, text outside scripts, and cells by table; what is opened is closed."""

    def __init__(self, text):
        super().__init__()
        self.tags, self.open, self.cells, self.table, self.cell, self.text = [], [], {}, None, None, []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        attrs = dict(attrs)
        self.tags.append((tag, attrs))
        if tag not in VOID:
            self.open.append(tag)
        if tag == "table":
            self.table = attrs.get("data-table", "")
            self.cells[self.table] = []
        if tag == "tr":
            self.cells[self.table].append([])
        if tag in ("td", "th"):
            self.cell = [attrs.get("data-value"), ""]

    def handle_startendtag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))

    def handle_endtag(self, tag):
        assert self.open.pop() == tag
        if tag in ("td", "th"):
            self.cells[self.table][-1].append(tuple(self.cell))
            self.cell = None

    def handle_data(self, data):
        if not {"script", "style"} & set(self.open[-1:]):
            self.text.append(data)
            if self.cell:
                self.cell[1] += data

    def of(self, tag):
        return [attrs for name, attrs in self.tags if name == tag]

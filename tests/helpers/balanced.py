"""HTML of which every element that is opened is closed, in order."""

from html.parser import HTMLParser


class Balanced(HTMLParser):
    """Fails unless the elements of a text are closed in order; its texts are the `cells`."""

    def __init__(self, text):
        super().__init__()
        self.open, self.cells = [], []
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag, attributes):
        if tag not in ("meta", "br"):
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, text):
        self.cells.append(text)

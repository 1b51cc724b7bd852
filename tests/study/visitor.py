"""A simulated participant over plain HTTP, as a browser without scripts would be one; its answers are test data."""

import html
import re
import urllib.error
import urllib.parse
import urllib.request


class Visitor:
    def __init__(self, base, path, choose=lambda name: "3"):
        self.base, self.path, self.choose = base, path, choose

    def get(self):
        with urllib.request.urlopen(self.base + self.path, timeout=30) as reply:
            return reply.read().decode()

    def post(self, **form):
        """What the server answers at the end of its redirections."""
        data = urllib.parse.urlencode(form).encode()
        with urllib.request.urlopen(self.base + self.path, data, timeout=60) as reply:
            return reply.read().decode()

    def status(self, path):
        try:
            with urllib.request.urlopen(self.base + path, timeout=30) as reply:
                return reply.status
        except urllib.error.HTTPError as error:
            return error.code

    def answers(self, page):
        """What a form is sent with."""
        form = {"do": "answer", "page": re.findall(r'name="page" value="(\w+)"', page)[-1]}
        check = re.search(r"please choose <q>(.*?)</q>", page)
        for name in dict.fromkeys(re.findall(r'data-question="(\w+)"', page)):
            if check:
                word = re.escape(check.group(1))
                form[name] = re.search(rf'value="(\d)"[^>]*><b>\d</b><span>{word}</span>', page).group(1)
            elif name == "preference":
                form[name] = "left"
            else:
                form[name] = "40" if name.startswith("tlx") else self.choose(name)
        return form

    def step(self, page):
        if 'name="agree"' in page:
            return self.post(do="consent", agree="yes")
        if 'name="said"' in page and "Finished with this path?" not in page:
            turn = re.search(r'name="turn" value="(\d+)"', page).group(1)
            return self.post(do="say", page=re.search(r'name="page" value="(\w+)"', page).group(1), turn=turn,
                             said="go up by 0.1", on="current")  # fmt: skip
        return self.post(**self.answers(page))

    def finish(self, pages=None):
        """Answer everything; every page that came is kept."""
        page, seen = self.get(), []
        while "<h1>Thank you</h1>" not in page:
            seen.append(page)
            assert len(seen) < (pages or 200), heading(page)
            page = self.step(page)
        return [*seen, page]


def heading(page):
    return html.unescape(re.search(r"<h1>(.*?)</h1>", page, re.DOTALL).group(1))

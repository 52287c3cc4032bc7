"""Links of the book that lead to files of the repository outside of docs: the file must exist, and its link becomes plain text."""

import logging
import re
from pathlib import Path

LINK = re.compile(r"(?<!!)\[([^\]]+)\]\(((?:\.\./)+[^)#]+)(?:#[^)]*)?\)")
log = logging.getLogger("mkdocs.plugins.links")


def on_page_markdown(markdown, page, config, **_):
    docs = Path(config["docs_dir"]).resolve()
    folder = Path(page.file.abs_src_path).parent

    def plain(link):
        text, target = link.groups()
        path = (folder / target).resolve()
        if path.is_relative_to(docs):
            return link.group()
        if not path.exists():
            log.warning("%s links to %s, which does not exist", page.file.src_path, target)
        return text

    return LINK.sub(plain, markdown)

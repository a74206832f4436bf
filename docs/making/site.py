"""Hooks of the site: pages made from the code, navigation by folder, formulas as MathML, files of the repository."""

import re
from pathlib import Path, PurePosixPath
from typing import Any

import formulas
import gallery
import nav
import offline
import reference
import rooms
import runs
import scene_format
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files, InclusionLevel

ROOT = Path(__file__).parents[2]
OUTSIDE = {"index.md": "README.md", "contributing.md": "CONTRIBUTING.md", "changelog.md": "CHANGELOG.md"}
"""Pages of the site, and their files in the root of the repository."""
FORMAT = "scenes.md"
"""The page of all tables of a scene."""
PICTURE = re.compile(r"!\[[^]]*\]\(docs/images/report_page\.png\)")
"""Picture of the report; the site's first page shows the report itself."""
LINK = re.compile(r"(?<=\]\()(?![a-z]+:|#|/)([^)\s#]+)")
FENCED = re.compile(r"^ *(```+|~~~+).*?^ *\1 *$", re.DOTALL | re.MULTILINE)


def on_files(files: Files, config: Any) -> Files:
    """Add the generated pages, and list all pages in the navigation."""
    for page, source in OUTSIDE.items():
        if (ROOT / source).is_file():
            files.append(File.generated(config, page, abs_src_path=str(ROOT / source)))
    for made in (*reference.pages(ROOT), *gallery.pages()):
        if (old := files.get_file_from_path(made.path)) is not None:
            files.remove(old)
        files.append(File.generated(config, made.path, **made.content))
    config.nav = nav.expanded(config.nav, files)
    return files


def on_page_markdown(markdown: str, page: Any, config: Any, files: Files) -> str:
    """Fill the generated tables, and point links to other files of the repository at copies in the site."""
    if page.file.src_uri == FORMAT and (missing := scene_format.left_out(markdown)):
        raise PluginError(f"{FORMAT} leaves out the tables of {', '.join(sorted(missing))}")
    if page.file.src_uri == "index.md":
        markdown = PICTURE.sub("<!-- report: steel_four_bar -->", markdown)
    markdown = rooms.with_rooms(gallery.with_scenes(scene_format.with_tables(markdown), page.file.src_uri))
    source = Path(page.file.abs_src_path) if page.file.abs_src_path else ROOT / "docs" / page.file.src_uri
    parts, end = [], 0
    for block in FENCED.finditer(markdown):
        parts += [_led(markdown[end : block.start()], source, page, config, files), block[0]]
        end = block.end()
    return "".join([*parts, _led(markdown[end:], source, page, config, files)])


def _led(text: str, source: Path, page: Any, config: Any, files: Files) -> str:
    def target(link: re.Match[str]) -> str:
        there = (source.parent / link[1]).resolve()
        if not there.is_file() or not there.is_relative_to(ROOT):
            return link[1]  # MkDocs reports the dead link
        path = _of_site(there.relative_to(ROOT))
        if files.get_file_from_path(path) is None:
            files.append(File.generated(config, path, abs_src_path=str(there), inclusion=InclusionLevel.INCLUDED))
        up = len(PurePosixPath(page.file.src_uri).parts) - 1
        return "../" * up + path

    return LINK.sub(target, text)


def _of_site(path: Path) -> str:
    """Path in the site of a file of the repository."""
    name = path.as_posix()
    pages = {source: page for page, source in OUTSIDE.items()}
    if name in pages:
        return pages[name]
    return name.removeprefix("docs/") if name.startswith("docs/") and path.suffix != ".ipynb" else f"repository/{name}"


def on_page_content(html: str, page: Any, config: Any, files: Files) -> str:
    """Convert formulas to MathML."""
    return formulas.drawn(html, page.file.src_uri)


def on_post_page(output: str, page: Any, config: Any) -> str:
    """Make a page independent of the network."""
    return offline.local(output, page.file.dest_uri)


def on_post_template(output_content: str, template_name: str, config: Any) -> str:
    """Make the 404 page independent of the network."""
    return offline.local(output_content, template_name)


def on_post_build(config: Any) -> None:
    """Check that no page fetches from a network, and delete runs of other program versions."""
    offline.cleaned(Path(config.site_dir))
    runs.drop_others()

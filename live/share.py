"""Web links that contain the text of a scene, and the landing page of these links."""

import zlib
from base64 import b64encode, urlsafe_b64decode
from hashlib import sha256

from kinelast.scene.text import LARGEST_FILE, decoded
from kinelast.values.error import SceneError

MARK = "#scene="


def linked(link: str) -> str:
    """Return the text of the scene in a link. Raise SceneError if the link is damaged."""
    letters = link.partition(MARK)[2].strip()
    try:
        inflate = zlib.decompressobj()
        content = inflate.decompress(urlsafe_b64decode(letters + "=" * (-len(letters) % 4)), LARGEST_FILE)
    except (ValueError, zlib.error):
        content = b""
    if not content or not inflate.eof:
        raise SceneError("", "", "", "the link contains no readable scene: copy the complete link")
    return decoded(content, "")


SCRIPT = r"""
const path = localStorage.getItem("live path") ?? "";
if (/^\/[\w-]+\/$/.test(path)) location.replace(path + location.hash);
"""
WORDS = """This link contains a mechanism. No editor has been opened at this address in this browser yet, so it cannot
be shown here. Please copy the link, open the address that <code>deflection-report --live</code> printed in the
terminal, and paste the link into that page."""
LANDING = f'<!doctype html><html lang="en"><title>Live scene</title><p>{WORDS}</p><script>{SCRIPT}</script></html>'
"""Landing page of web links. It opens the editor that the browser used last. If there is none, it explains the link."""
HASH = b64encode(sha256(SCRIPT.encode()).digest()).decode()
POLICY = f"default-src 'none'; script-src 'sha256-{HASH}'; frame-ancestors 'none'"

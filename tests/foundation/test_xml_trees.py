"""XML of strangers is bounded, and can name nothing outside itself."""

from __future__ import annotations

from pathlib import Path

import pytest

from bufferstand.foundation.errors import BadInput
from bufferstand.foundation.files import xml_trees
from bufferstand.foundation.files.xml_trees import DEEPEST, xml_tree

SECRET = "not to be read"
BOMB = '<!DOCTYPE a [<!ENTITY b "bb"><!ENTITY c "&b;&b;">]><a>&c;</a>'


def test_what_is_xml_is_read_in_any_of_its_encodings(tmp_path: Path) -> None:
    path = tmp_path / "a.xml"
    for encoding in ("utf-8", "utf-16", "iso-8859-1"):
        path.write_bytes(f'<?xml version="1.0" encoding="{encoding}"?><a b="1">ü</a>'.encode(encoding))
        root = xml_tree(path)
        assert (root.tag, root.get("b"), root.text) == ("a", "1", "ü")


@pytest.mark.parametrize(
    "text",
    [
        BOMB,
        '<!DOCTYPE a SYSTEM "secret.txt"><a/>',
        '<!DOCTYPE a [<!ENTITY x SYSTEM "secret.txt">]><a>&x;</a>',
    ],
)
def test_document_types_are_refused_before_they_are_read(tmp_path: Path, text: str) -> None:
    (tmp_path / "secret.txt").write_text(SECRET)
    path = tmp_path / "a.xml"
    path.write_text(text)
    with pytest.raises(BadInput, match="it has a document type") as refused:
        xml_tree(path)
    assert SECRET not in str(refused.value)


def test_depth_number_and_size_are_bounded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.xml"
    path.write_text("<a>" * DEEPEST + "</a>" * DEEPEST)
    assert len(list(xml_tree(path).iter())) == DEEPEST
    path.write_text("<a>" * (DEEPEST + 1) + "</a>" * (DEEPEST + 1))
    with pytest.raises(BadInput, match="lie within one another"):
        xml_tree(path)
    monkeypatch.setattr(xml_trees, "MOST_ELEMENTS", 10)
    path.write_text("<a>" + "<b/>" * 9 + "</a>")
    assert len(xml_tree(path)) == 9
    path.write_text("<a>" + "<b/>" * 10 + "</a>")
    with pytest.raises(BadInput, match="more than 10 elements"):
        xml_tree(path)
    monkeypatch.setattr(xml_trees, "LARGEST", 1 << 20)
    path.write_text("<a>" + " " * (1 << 20) + "</a>")
    with pytest.raises(BadInput, match="longer than 1 MiB"):
        xml_tree(path)


def test_what_cannot_be_read_is_said(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="it cannot be read") as refused:
        xml_tree(tmp_path)
    assert refused.value.file == str(tmp_path)
    (tmp_path / "a.xml").write_text("<a>&b;</a>")
    with pytest.raises(BadInput, match="line 1, column 4: it is no XML"):
        xml_tree(tmp_path / "a.xml")

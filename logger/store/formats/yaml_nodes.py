"""YAML files that people write, as nodes that know their line (``drivers.plain_yaml``) and complain as BadInput."""

from collections.abc import Iterable
from pathlib import Path

from drivers import plain_yaml
from logger.errors import BadInput, did_you_mean
from logger.files import SETTINGS_BYTES, read_bounded


class Node(plain_yaml.Node):
    """One value of a YAML file. Each asking method raises BadInput when the value is something else."""

    def complaint(self, words: str) -> BadInput:
        """The error to raise here: ``file:line: <words>``."""
        return BadInput(f"{self.file}:{self.line}: {words}")

    def wrong(self, expected: str) -> BadInput:
        return BadInput(str(super().wrong(expected)))

    def hint(self, key: str, known: Iterable[str]) -> str:
        return did_you_mean(key, known)


def load_mapping(path: Path | str) -> Node:
    """Read a YAML file whose top is a mapping. Raises BadInput, which names file and line, for anything else."""
    data = read_bounded(path, SETTINGS_BYTES)
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError as error:
        raise BadInput(f"{path}:{data.count(10, 0, error.start) + 1}: expected UTF-8 text") from None
    return parse_mapping(text, str(path))


def parse_mapping(text: str, file: str) -> Node:
    """The same for text at hand; ``file`` is the name that complaints carry."""
    return plain_yaml.parse_mapping(text, file, Node)

"""YAML as every file of the toolkit is read: data alone, and each key once."""

from __future__ import annotations

from typing import Any

import yaml


class RepeatedKeyError(yaml.constructor.ConstructorError):
    """A key is stated twice in one mapping."""


class _OnceLoader(yaml.SafeLoader):
    """Refuses a key that is stated twice, where YAML would silently take the last."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        seen: set[str] = set()
        for key, _ in node.value:
            # A merged mapping, '<<', may be overridden.
            if isinstance(key, yaml.ScalarNode) and key.tag != "tag:yaml.org,2002:merge":
                if key.value in seen:
                    said = f"key '{key.value}' is stated twice"
                    raise RepeatedKeyError(None, None, said, key.start_mark)
                seen.add(key.value)
        return super().construct_mapping(node, deep)


def parse_yaml(text: str) -> Any:
    """The content of YAML text.

    Raises
    ------
    yaml.YAMLError
        If it is none.
    RepeatedKeyError
        If it states a key twice.
    """
    return yaml.load(text, Loader=_OnceLoader)

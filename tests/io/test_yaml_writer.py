import pytest
import yaml

from railui.io.yaml_document import parse_yaml
from railui.io.yaml_writer import YamlWriter


def test_blocks_indent_entries_lists_and_comments():
    writer = YamlWriter()
    with writer.block("adjustment"):
        writer.entry("campaign", "campaign.yaml", comment="relative to the design")
        writer.items("covariance", [[1.0, 0.5], [0.5, 1.0]])
        writer.comment("end")
    writer.entry("name", "a: b")
    assert writer.text() == (
        "adjustment:\n  campaign: campaign.yaml  # relative to the design\n  covariance:\n"
        '    - [1, 0.5]\n    - [0.5, 1]\n  # end\nname: "a: b"\n'
    )


def test_an_exception_in_a_block_restores_the_indentation():
    writer = YamlWriter()
    with pytest.raises(RuntimeError), writer.block("group"):
        raise RuntimeError
    writer.entry("next", 1)
    assert writer.text() == "group:\nnext: 1\n"


@pytest.mark.parametrize("key", ["plain", "a: b", "1", "true", "# no comment", "vehicle.frame.mass"])
def test_any_key_and_value_read_back_as_written(key):
    writer = YamlWriter()
    writer.entry(key, {key: [key, None, True, 0.1]})
    writer.items("empty", [])
    expected = {key: {key: [key, None, True, 0.1]}, "empty": []}
    assert parse_yaml(writer.text()).value == expected
    assert yaml.safe_load(writer.text()) == expected

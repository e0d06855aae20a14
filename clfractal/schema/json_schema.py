"""The JSON Schema of sections, with those that stand within them and are otherwise made when values come."""

from typing import Any

from pydantic.json_schema import GenerateJsonSchema

from clfractal.schema.base import PART


class JsonSchema(GenerateJsonSchema):
    """As pydantic's, with the own schema of each section that stands within another."""

    def generate_inner(self, schema: Any) -> dict[str, Any]:
        """What a schema becomes in JSON."""
        return super().generate_inner(_own(schema))

    def field_title_should_be_set(self, schema: Any) -> bool:
        """Whether a value is titled by its key: sections have titles of their own."""
        return super().field_title_should_be_set(_own(schema))


def _own(schema: Any) -> Any:
    section = schema.get("metadata", {}).get(PART)
    if section is None:
        return schema
    section.model_rebuild()
    return section.__pydantic_core_schema__

"""The `budget:` of a campaign.yaml.

```yaml
budget:
  target_sigma_mm: 0.003           # reflector's centre, per axis
  scale_sigma_ppm: 0.5             # instrument's length scale
  temperature_sigma_degc: 1.0      # robot in use against the campaign
  expansion_ppm_per_degc: 12       # needed with a temperature
  readings: declared               # or repeats: their scatter in place of the stated one
```
"""

from robocal.formats.fields import Fields
from robocal.uncertainty.budget import Budget, ReadingsBy


def read_budget(campaign: Fields) -> Budget:
    """The budget, empty where the campaign has none.

    Raises
    ------
    BadInput
        Naming the field.
    """
    if "budget" not in campaign:
        return Budget()
    fields = campaign.mapping("budget")
    figures = {
        name: fields.number(name, 0.0)
        for name in (
            "target_sigma_mm",
            "scale_sigma_ppm",
            "temperature_sigma_degc",
            "expansion_ppm_per_degc",
        )
    }
    for name, value in figures.items():
        if value < 0:
            raise fields.error(name, f"must not be negative, not {value:g}")
    if figures["temperature_sigma_degc"] > 0 and "expansion_ppm_per_degc" not in fields:
        raise fields.error(
            "expansion_ppm_per_degc", "is missing; steel has 12, aluminium 23 ppm per degC"
        )
    readings = fields.text("readings", ReadingsBy.declared.value)
    if readings not in set(ReadingsBy):
        raise fields.error("readings", f"must be declared or repeats, not '{readings}'")
    fields.finish()
    return Budget(
        target=figures["target_sigma_mm"] * 1e-3,
        scale=figures["scale_sigma_ppm"] * 1e-6,
        temperature=figures["temperature_sigma_degc"],
        expansion=figures["expansion_ppm_per_degc"] * 1e-6,
        readings=ReadingsBy(readings),
    )

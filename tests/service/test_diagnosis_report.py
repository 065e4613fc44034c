"""How the diagnosis is told to a person."""

import pytest

from service import diagnosis_report


@pytest.mark.parametrize(
    ("name", "value", "told"),
    [
        ("compliance_rad_per_nm", 1.2e-6, "compliance in µrad per N·m: 1.2 "),
        ("bending_rad_per_nm", 3e-7, "bending in µrad per N·m: 0.3 "),
        ("pull_times_mass_2_rad_kg_per_nm", 2e-6, "pull times mass 2 in µrad·kg per N·m: 2 "),
        ("drift_rad_per_k", 4e-6, "drift in µrad per K: 4 "),
        ("expansion_per_k", 1.1e-5, "expansion in ppm per K: 11 "),
        ("width_rad", 5e-4, "width in mrad: 0.5 "),
        ("step_m", 4e-4, "step in mm: 0.4 "),
        ("width_m", 3e-4, "width in mm: 0.3 "),
        ("drift_m_per_k", 4e-6, "drift in µm per K: 4 "),
        ("coupling_m_per_rad", 2e-3, "coupling in mm per rad: 2 "),
        ("coupling_rad_per_m", 2e-3, "coupling in mrad per mm: 0.002 "),
        ("step_x_m", 2.5e-4, "step x in mm: 0.25 "),
        ("gain", 0.01, "gain: 0.01 "),
    ],
)
def test_a_coefficient_is_told_in_a_unit_that_cannot_be_taken_for_another(name, value, told):
    assert diagnosis_report.measure_text(name, value, value / 10).startswith(f"{told}± ")

"""Reads what `runout` wrote with readers that are not ours, and holds it against the program's own numbers.

Run in a folder with `slide/` and `outcome.json` (of `runout simulate --out slide --json`), `outcomes.parquet`,
`outcomes.csv` and `status.json`. Every failed assertion is an exit code of 1 with a traceback.
"""

import json
import xml.etree.ElementTree as xml

import meshio
import numpy as np
import pandas as pd
import polars as pl

FIELDS = {
    "displacement_m": 3,
    "velocity_m_s": 3,
    "effective_stress_kpa": 6,
    "pore_pressure_kpa": 1,
    "plastic_strain": 1,
    "porosity": 1,
    "volume_m2": 1,
    "layer": 1,
    "cohesion_kpa": 1,
    "friction_angle_deg": 1,
    "unit_weight_kn_m3": 1,
}

# Lists, or of use with lists only, so that a table of text has no place for them.
PROFILE = ["profile_column_m", "deposit_depth_mm", "highest_speed_mm_s"]


def series():
    """The moments of the slide, in time, as meshio reads them."""
    listed = xml.parse("slide/series.pvd").getroot().iter("DataSet")
    moments = [(float(entry.get("timestep")), meshio.read("slide/" + entry.get("file"))) for entry in listed]
    assert len(moments) > 5, len(moments)
    assert all(a[0] < b[0] for a, b in zip(moments, moments[1:])), "times grow"
    return moments


def check_series():
    with open("outcome.json") as file:
        outcome = json.load(file)
    moments = series()
    ground = None
    for time, mesh in moments:
        assert len(mesh.points) == outcome["points"], (time, len(mesh.points))
        assert [block.type for block in mesh.cells] == ["vertex"]
        assert set(mesh.point_data) == set(FIELDS), sorted(mesh.point_data)
        for name, components in FIELDS.items():
            values = mesh.point_data[name].reshape(outcome["points"], -1)
            assert values.shape[1] == components, (name, values.shape)
            assert np.isfinite(values).all(), (time, name)
        # Points keep their order: less their displacement they are where they began.
        began = mesh.points - mesh.point_data["displacement_m"]
        ground = began if ground is None else ground
        np.testing.assert_allclose(began, ground, atol=1e-9)
        assert (mesh.points[:, 2] == 0).all()
        assert (mesh.point_data["volume_m2"] > 0).all()
    first, last = moments[0], moments[-1]
    assert first[0] == 0 and abs(last[0] - outcome["simulated_s"]) < 1e-9, (first[0], last[0])
    assert np.abs(first[1].point_data["displacement_m"]).max() == 0
    moved = np.linalg.norm(last[1].point_data["displacement_m"], axis=1)
    np.testing.assert_allclose(moved.max(), outcome["max_displacement_m"], rtol=1e-12)
    assert moved.max() > 0.1, "a slide that moved"
    # Before failure the points fill a square lattice that begins at the toe, but for the millimetres that the ground has
    # settled under its weight.
    spacing = np.round(np.sqrt(np.median(first[1].point_data["volume_m2"])), 2)
    places = ground[:, :2] / spacing - 0.5
    np.testing.assert_allclose(places, np.round(places), atol=0.05)
    assert len(np.unique(np.round(places), axis=0)) == outcome["points"], "one point a place"


def check_grid():
    """The background grid: squares that share their corners and hold the soil, as many points in each full one."""
    grid = meshio.read("slide/grid.vtu")
    assert [block.type for block in grid.cells] == ["quad"]
    corners = grid.points[grid.cells[0].data][:, :, :2]
    sides = np.roll(corners, -1, axis=1) - corners
    # Lower side, right side, upper side, left side.
    side = sides[0, 0, 0]
    np.testing.assert_allclose(sides, side * np.array([[[1, 0], [0, 1], [-1, 0], [0, -1]]]) + 0 * sides, atol=1e-9)
    columns, rows = np.round(np.ptp(grid.points[:, :2], axis=0) / side).astype(int)
    assert len(corners) == columns * rows and len(grid.points) == (columns + 1) * (rows + 1)
    least, most = grid.points[:, :2].min(axis=0), grid.points[:, :2].max(axis=0)
    moments = series()
    for _, mesh in moments:
        assert (mesh.points[:, :2] > least).all() and (mesh.points[:, :2] < most).all()
    began = moments[0][1].points - moments[0][1].point_data["displacement_m"]
    _, counts = np.unique(np.floor((began[:, :2] - least) / side), axis=0, return_counts=True)
    spacing = np.sqrt(np.median(moments[0][1].point_data["volume_m2"]))
    assert np.median(counts) == np.round((side / spacing) ** 2), (np.median(counts), side, spacing)


def check_outcomes():
    with open("status.json") as file:
        status = json.load(file)
    pandas = pd.read_parquet("outcomes.parquet")
    csv = pd.read_csv("outcomes.csv")
    assert [name for name in pandas.columns if name not in PROFILE] == list(csv.columns)
    assert set(PROFILE) <= set(pandas.columns)
    for name in csv.columns:
        if csv[name].dtype.kind in "if":
            # The fastest way of pandas to read a number loses its last digit.
            np.testing.assert_allclose(csv[name], pandas[name], rtol=1e-15)
    samples = pandas.query("outcome == 'runout'").displacement_q999_m
    assert len(pandas) == status["realisations"] and len(samples) == status["samples"]
    np.testing.assert_allclose(samples.mean(), status["mean_m"], rtol=1e-12)
    np.testing.assert_allclose(samples.var(), status["variance_m2"], rtol=1e-12)
    slides = pandas[pandas.outcome == "runout"]
    assert (slides.profile_column_m > 0).all()
    # Where the contiguous front has come, something lies or has passed.
    reached = slides[slides.toe_advance_m > slides.profile_column_m]
    assert (reached.highest_speed_mm_s.map(len) > 0).all() and len(reached) > 0
    assert all((depths >= 0).all() for depths in slides.deposit_depth_mm)
    polars = pl.read_parquet("outcomes.parquet").filter(pl.col("outcome") == "runout")["displacement_q999_m"]
    assert polars.to_list() == samples.to_list()


check_series()
check_grid()
check_outcomes()
print("readers agree")

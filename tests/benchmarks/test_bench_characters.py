"""The benchmark of textured characters runs from end to end."""


def test_no_point_is_torn_and_textures_are_kept(run_quick):
    rows, printed, page = run_quick("bench_characters.py")
    assert [row["file"] for row in rows] == [".obj", ".glb"]
    for row in rows:
        assert row["torn"] == 0
        assert row["loose"] > 0
        assert row["kept"]
        assert row["said"]
    assert "torn without weld_seams" in page
    assert "biped, cylinder" in printed

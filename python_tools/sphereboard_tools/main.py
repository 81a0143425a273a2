"""The command line: ``check-…`` and ``bake-methods`` for the tests; for benches, times and tables."""

import argparse
import sys
from pathlib import Path

from sphereboard_tools.images import BadInputError


def parser() -> argparse.ArgumentParser:
    """Describe the arguments."""
    top = argparse.ArgumentParser(prog="sphereboard-tools", description="Checks of sphereboard by independent implementations.")
    commands = top.add_subparsers(dest="command", required=True)

    masks = commands.add_parser("check-segmentation", help="repeat the hsv method with OpenCV and scikit-image; compare methods")
    masks.add_argument("--photos", type=Path, nargs="+", default=[], metavar="DIR", help="folders of photographs")
    masks.add_argument("--binary", type=Path, metavar="PATH", help="the sphereboard program (default: the one in target/)")
    masks.add_argument("--out", type=Path, metavar="DIR", default=Path("results/local/segmentation"), help="where tables go")
    masks.add_argument("--quick", action="store_true", help="only the agreement, not the comparison of methods")

    meshes = commands.add_parser("check-mesh", help="have Open3D check the meshes of GLB files")
    meshes.add_argument("files", type=Path, nargs="+", metavar="GLB")
    imports = commands.add_parser("check-import", help="have Open3D count what sphereboard inspect counts in models of any origin")
    imports.add_argument("files", type=Path, nargs="+", metavar="MODEL")
    imports.add_argument("--binary", type=Path, metavar="PATH", help="the sphereboard program (default: the one in target/)")
    depth = commands.add_parser("check-depth", help="have OpenImageIO read depth pictures and repeat our comparisons")
    depth.add_argument("model", type=Path, metavar="MODEL", help="what is drawn")
    depth.add_argument("pairs", type=Path, metavar="DIR", help="where cargo test --test depth left its pairs")
    depth.add_argument("--out", type=Path, metavar="DIR", default=Path("results/local/depth"), help="where the render goes")
    depth.add_argument("--binary", type=Path, metavar="PATH", help="the sphereboard program (default: the one in target/)")
    metrics = commands.add_parser("check-metrics", help="have flip-evaluator, scikit-image and OpenImageIO repeat our metrics")
    metrics.add_argument("pairs", type=Path, metavar="DIR", help="where cargo test --test metrics left its pairs")
    baking = commands.add_parser("bake-methods", help="bake every method that takes a grown tree, for other programs to draw")
    baking.add_argument("preset", help="of `sphereboard grow --list`; a small one")
    baking.add_argument("--binary", type=Path, metavar="PATH", help="the sphereboard program (default: the one in target/)")
    baking.add_argument("--out", type=Path, metavar="DIR", default=Path("results/local/bake"), help="where files and pictures go")
    viewers = commands.add_parser("check-viewers", help="compare what another program drew of baked files with what we draw")
    viewers.add_argument("folder", type=Path, metavar="DIR", help="where bake-methods wrote")
    viewers.add_argument("program", choices=["three", "blender"], help="whose pictures")
    timing = commands.add_parser("time-hsv", help="time OpenCV's hsv steps for the benches: runs per line in, seconds out")
    timing.add_argument("picture", type=Path)
    timing.add_argument("opening_px", type=int)
    timing.add_argument("closing_px", type=int)
    bench = commands.add_parser("bench-report", help="tables of what `make bench` measured")
    bench.add_argument("criterion", type=Path, help="criterion's folder of results")
    bench.add_argument("out", type=Path, help="where README.md and bench.csv go")
    board = commands.add_parser("scoreboard", help="one table of several comparisons, for results/scoreboard")
    board.add_argument("folders", type=Path, nargs="+", metavar="DIR", help="where sphereboard compare wrote")
    board.add_argument("--out", type=Path, required=True, metavar="DIR", help="where README.md is and scoreboard.csv goes")
    models = commands.add_parser("model-table", help="a table of what `sphereboard model --json` printed")
    models.add_argument("summary", type=Path)
    models.add_argument("out", type=Path, metavar="CSV")
    return top


def main() -> int:
    """Run the command; the exit code is 0 when all is well, 1 when something is wrong, 2 when it cannot be checked."""
    arguments = parser().parse_args()
    try:
        # Imported late: Open3D takes a second that the other command need not wait for.
        if arguments.command == "check-mesh":
            from sphereboard_tools import check_mesh

            good = check_mesh.run(arguments.files)
        elif arguments.command == "check-import":
            from sphereboard_tools import check_import

            good = check_import.run(arguments.files, arguments.binary)
        elif arguments.command == "check-depth":
            from sphereboard_tools import check_depth

            good = check_depth.run(arguments.model, arguments.pairs, arguments.out, arguments.binary)
        elif arguments.command == "check-metrics":
            from sphereboard_tools import check_metrics

            good = check_metrics.run(arguments.pairs)
        elif arguments.command == "bake-methods":
            from sphereboard_tools import check_viewers

            good = check_viewers.bake_methods(arguments.binary, arguments.preset, arguments.out)
        elif arguments.command == "check-viewers":
            from sphereboard_tools import check_viewers

            good = check_viewers.compare(arguments.folder, arguments.program)
        elif arguments.command == "time-hsv":
            from sphereboard_tools import time_hsv

            good = time_hsv.run(arguments.picture, arguments.opening_px, arguments.closing_px)
        elif arguments.command == "bench-report":
            from sphereboard_tools import bench_report

            good = bench_report.run(arguments.criterion, arguments.out)
        elif arguments.command == "scoreboard":
            from sphereboard_tools import scoreboard

            good = scoreboard.run(arguments.folders, arguments.out)
        elif arguments.command == "model-table":
            from sphereboard_tools import model_table

            good = model_table.run(arguments.summary, arguments.out)
        else:
            from sphereboard_tools import check_segmentation

            good = check_segmentation.run(arguments.photos, arguments.binary, arguments.out, quick=arguments.quick)
    except (BadInputError, OSError) as error:
        print(f"sphereboard-tools: {error}", file=sys.stderr)
        return 2
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())

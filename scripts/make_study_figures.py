"""Make the figures of docs/studies.md: python scripts/make_study_figures.py."""

from pathlib import Path
from tempfile import TemporaryDirectory

import softhand
from softhand.studies.sweeps.figures import draw_all

ROOT = Path(__file__).parent.parent
IMAGES = {"success": "study.png", "scatter": "study-scatter.png"}


def main():
    """Sweep the example, and keep two of its figures."""
    with TemporaryDirectory() as folder:
        swept = softhand.sweep(ROOT / "examples/study.toml", folder)
        print(swept, swept.rate())
        figures = draw_all(swept)
    for name, file in IMAGES.items():
        softhand.save_figure(figures[name], ROOT / "docs/images" / file)


if __name__ == "__main__":
    main()

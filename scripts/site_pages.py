"""What mkdocs cannot do by itself for the site: tutorials that are run, the reference, files of the root, equations.

mkdocs.yml names it as a hook.
"""

from __future__ import annotations

import re
from html import escape, unescape
from pathlib import Path
from typing import Any

from latex2mathml.converter import convert
from markdown.extensions import Extension
from markdown.inlinepatterns import InlineProcessor
from mkdocs.structure.files import File, Files
from notebooks import run_notebook

ROOT = Path(__file__).parent.parent

REFERENCE: dict[str, tuple[str, str, tuple[str, ...]]] = {
    "runs": (
        "Runs",
        "One run, many runs, and what they leave behind. Numbers are SI: m, kg, s, N, rad.",
        ("simulate", "build", "Simulation", "rollout", "Runs", "compare", "sweep", "Sweep", "load_sweep",
         "Scenario", "load_scenario", "scenarios", "scenario_names", "check", "Recording", "load_recording"),
    ),
    "parts": (
        "Parts to build on",
        "Classes that yours derive from, what they are handed, and what a run is made of.",
        ("Controller", "LinearSetPoint", "Observation", "Law", "Damping", "Reference", "Goal", "Stepper", "Integration",
         "Plant", "State", "Push", "blocks"),
    ),
    "grasps": (
        "Grasps",
        "Where to touch an object, how good a grasp is, and where a hand can hold it.",
        ("new_scenario", "NewScenario", "grasp_quality", "GraspQuality", "propose_grasps", "Proposals", "Proposal",
         "sample_grasps", "GraspCache",
         "place_object", "Placement", "workspace", "Workspace", "squeeze", "Squeeze", "SqueezeCurve", "slip_margin",
         "SlipMargin", "worst_push", "WorstPush"),
    ),
    "analysis": (
        "Analysis",
        "What a run, a loop or a measurement tells.",
        ("summarize", "Summary", "energy_ledger", "Ledger", "linearize", "Linearizer", "Linearization", "ClosedLoop",
         "gradient", "Gradient", "QuadraticCost", "PeakCost", "FunctionCost", "tune", "Tuning",
         "stability", "Stability", "stability_along", "StabilityAlong", "Margins", "Mode",
         "design_lqr", "LqrDesign", "design_gains", "GainDesign",
         "linearize_plant", "LinearModel", "lyapunov", "Lyapunov",
         "grasp_stiffness", "GraspStiffness", "equilibrium", "Equilibrium", "measurement_noise", "MeasurementNoise",
         "collisions", "Collisions", "Collision", "identify", "Identification",
         "calibrate", "Calibration", "Log",
         "marker_displacements", "Markers", "depth_image", "tactile_pressure", "taxel_points", "taxel_pattern",
         "material_of", "Material", "material_tip", "MaterialTip"),
    ),
    "contacts": (
        "Inside a contact",
        "Which part of a contact slips already, how its limit grows with time, and friction of others beside it.",
        ("incipient_slip", "Patch", "PatchState", "limit_under_force", "limit_at_depth", "LimitOverTime", "CurvedLimit",
         "Bristles", "BristleState"),
    ),
    "pictures": (
        "Pictures and films",
        "Figures, reports, films and the viewers.",
        ("draw_run", "save_figure", "view", "Viewer", "MeshcatViewer", "write_report", "write_film"),
    ),
    "exports": (
        "Exports",
        "Recordings in the formats of other tools.",
        ("write_mcap", "read_mcap", "write_rrd"),
    ),
    "errors": (
        "Errors",
        "Every mistake that a user can mend is one of these; each names the thing, its value and the remedy.",
        ("SofthandError", "ScenarioError", "ModelError", "GraspError", "LawError", "ControllerError", "RecordingError",
         "SimulationStopped", "RolloutStopped", "StudyError", "SweepStopped", "BrowserError", "ScenarioWarning"),
    ),
}  # fmt: skip
"""Pages of the reference: title, a sentence, public names of softhand."""

_ROOT_PAGES = {"README.md": "index.md", "CONTRIBUTING.md": "contributing.md", "CHANGELOG.md": "changelog.md"}
_OBSERVATION = "api/parts.md#softhand.Observation"


class _Bracketed(InlineProcessor):
    """Text that only looks like a link by reference, of which there are none: `[-pi, pi] [rad]`."""

    def handleMatch(self, m: re.Match[str], data: str) -> tuple[str, int, int]:  # type: ignore[override]
        return m[0], m.start(0), m.end(0)


class _PlainBrackets(Extension):
    def extendMarkdown(self, md: Any) -> None:
        md.inlinePatterns.register(_Bracketed(r"\[[^\[\]]+\] ?\[[^\[\]]+\](?![(\[])", md), "brackets", 175)


def on_config(config: Any) -> None:
    """In pages and docstrings alike."""
    config.markdown_extensions.append(_PlainBrackets())


def on_files(files: Files, config: Any) -> Files:
    """Put in the tutorials as they ran, the pages of the reference, and those of the root."""
    for file in [file for file in files if file.src_uri.startswith("tutorials/") and file.src_uri.endswith(".py")]:
        files.remove(file)
        page = run_notebook(Path(file.abs_src_path))
        files.append(File.generated(config, file.src_uri.removesuffix(".py") + ".md", content=page.markdown))
        for name, data in page.pictures.items():
            files.append(File.generated(config, f"tutorials/{name}", content=data))
    for name, (title, sentence, members) in REFERENCE.items():
        files.append(File.generated(config, f"api/{name}.md", content=reference(title, sentence, members)))
    for name in ("CONTRIBUTING.md", "CHANGELOG.md"):
        text = re.sub(r"\]\(docs/", "](", (ROOT / name).read_text(encoding="utf-8"))
        text = re.sub(r"\]\((?!http|#)(?=\w+\.md|LICENSE|softhand/|examples|docs\))", "](../", text)
        text = re.sub(r"\]\(\.\./(?=" + "|".join(_pages()) + r")", "](", text)
        files.append(File.generated(config, _ROOT_PAGES[name], content=text))
    return files


def _pages() -> list[str]:
    return [re.escape(file.name) for file in (ROOT / "docs").glob("*.md")]


def reference(title: str, sentence: str, members: tuple[str, ...]) -> str:
    """A page of the reference: a directive of mkdocstrings for each name."""
    homes = ("softhand.controllers.blocks" if name == "blocks" else f"softhand.{name}" for name in members)
    return "\n\n".join([f"# {title}", sentence, *(f"::: {home}" for home in homes)]) + "\n"


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Links to what is not in docs/: to its page here, or no link but its text."""
    markdown = re.sub(r"\]\((tutorials/\w+)\.py\)", r"](\1.md)", markdown)
    return re.sub(r"\[([^\]]+)\]\(\.\./((?!api/)[^)#]+)(#[^)]*)?\)", lambda m: _link(m, page.file.src_uri), markdown)


def _link(match: re.Match[str], page: str) -> str:
    words, target, place = match[1], match[2], match[3] or ""
    if page.startswith("tutorials/"):  # ../ leads into docs/ from there
        return match[0]
    if target in _ROOT_PAGES:
        return f"[{words}]({_ROOT_PAGES[target]}{place})"
    if target == "softhand/sensing/observation.py":
        return f"[{words}]({_OBSERVATION})"
    return words


def on_page_content(html: str, **_: Any) -> str:
    """Equations as MathML, which browsers set by themselves, from disk too."""
    html = re.sub(r'<div class="arithmatex">\\\[(.*?)\\\]</div>', _equation, html, flags=re.DOTALL)
    inline = re.compile(r'<span class="arithmatex">\\\((.*?)\\\)</span>', re.DOTALL)
    return inline.sub(lambda match: convert(unescape(match[1])), html)


def _equation(match: re.Match[str]) -> str:
    """An equation of its own, its number at the right."""
    latex = unescape(match[1])
    numbers = re.findall(r"\\tag\{(.*?)\}", latex)
    math = convert(re.sub(r"\\tag\{.*?\}", "", latex).strip(), display="block")
    return f'<div class="equation">{math}{"".join(f"<span>({escape(number)})</span>" for number in numbers)}</div>'

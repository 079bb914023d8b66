# SPDX-License-Identifier: MIT
"""The FMU archive: description, sources, binaries, parameter set and experiment."""

from __future__ import annotations

import hashlib
import io
import re
import tempfile
import uuid
import xml.etree.ElementTree as ET
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import resources
from pathlib import Path

from drivetwin._util.atomic import write_bytes
from drivetwin.errors import InputError
from drivetwin.export.c.write import generate_twin_source, read_model_sources
from drivetwin.export.compiler import compile_library, detect_platform
from drivetwin.export.entries import Subject, list_entries
from drivetwin.export.fmu.describe import Header, build_description, list_variables
from drivetwin.export.fmu.experiment import Experiment, build_reference_files
from drivetwin.export.parameters.spelling import format_document
from drivetwin.export.targets import DEFAULT_STEP, FmiVersion, Platform

_FOLDERS = {
    FmiVersion.FMI2: {
        Platform.LINUX: "linux64",
        Platform.WINDOWS: "win64",
        Platform.MACOS: "darwin64",
    },
    FmiVersion.FMI3: {
        Platform.LINUX: "x86_64-linux",
        Platform.WINDOWS: "x86_64-windows",
        Platform.MACOS: "x86_64-darwin",
        Platform.MACOS_ARM: "aarch64-darwin",
    },
}
_NOT_IN_FMU = ("Makefile", "dt_observer.c", "dt_observer.h", "dt_run.c")


@dataclass(frozen=True, eq=False)
class BuildOptions:
    """Build options of an FMU; empty `platforms`: the current one, by its own compiler."""

    version: FmiVersion = FmiVersion.FMI2
    platforms: tuple[Platform, ...] = ()
    experiment: Experiment | None = None


def build_fmu(subject: Subject, path: Path, options: BuildOptions | None = None) -> None:
    """Write the FMU of a twin to `path`; the same twin gives the same bytes.

    Raises InputError for a model that C cannot represent and for a platform that the FMI version
    does not support, CompilerError, MissingExtraError, OSError.
    """
    options, subject = options or BuildOptions(), subject.reduce()
    _check_platforms(options)
    header, sources = _collect_sources(subject, options)
    files = {
        "modelDescription.xml": build_description(options.version, header, list_variables(subject)),
        **{f"sources/{name}": data for name, data in sources.items()},
        **_compile_binaries(header.identifier, sources, options),
        **build_reference_files(subject, options.experiment, options.version),
    }
    if options.version is FmiVersion.FMI3:
        files["sources/buildDescription.xml"] = _build_description(header)
    write_bytes(path, _build_archive(files))


def _check_platforms(options: BuildOptions) -> None:
    folders = _FOLDERS[options.version]
    if unknown := [each.value for each in options.platforms if each not in folders]:
        raise InputError(
            f"FMI {options.version} has no place for a binary of {', '.join(unknown)}",
            f"choose among {', '.join(each.value for each in folders)}, or FMI {FmiVersion.FMI3}",
        )


def make_identifier(name: str) -> str:
    """A C identifier from a name, short enough for a file."""
    text = re.sub(r"\W+", "_", name, flags=re.ASCII).strip("_") or "twin"
    return (text if text[0].isalpha() else f"twin_{text}")[:_LONGEST_IDENTIFIER]


_LONGEST_IDENTIFIER = 63
"""Significant characters of a C99 identifier; file names and archive paths may be longer."""


def _collect_sources(subject: Subject, options: BuildOptions) -> tuple[Header, dict[str, bytes]]:
    """Header of the description and all sources; the token marks both."""
    digit = options.version.value[0]
    fixed = {name: data for name, data in read_model_sources().items() if name not in _NOT_IN_FMU}
    for folder, pattern in (("source", rf"dt_fm(u\.|i{digit})"), ("headers", f"fmi{digit}")):
        place = resources.files("drivetwin.export.fmu") / folder
        for entry in place.iterdir():
            if re.match(pattern, entry.name):
                fixed[entry.name] = entry.read_bytes()
    fixed["dt_twin.c"] = generate_twin_source(subject).encode()
    token = _compute_token(fixed, options.experiment)
    places = " ".join(f"X({entry.field})" for entry in list_entries(subject.model))
    fixed["dt_fmu_twin.h"] = _TWIN_HEADER.format(token=token, places=places).encode()
    files = dict(sorted(fixed.items()))
    experiment = options.experiment
    header = Header(
        name=subject.name,
        identifier=make_identifier(subject.name),
        token=token,
        note=subject.note,
        start_time=0.0 if experiment is None else float(experiment.time[0]),
        stop_time=1.0 if experiment is None else float(experiment.time[-1]),
        step=DEFAULT_STEP if experiment is None else experiment.step,
        sources=tuple(name for name in files if name.endswith(".c")),
    )
    return header, files


_TWIN_HEADER = """/* SPDX-License-Identifier: MIT */
/* What marks this FMU, and its parameters in the order of their value references. */
#define DT_FMU_TOKEN "{token}"
#define DT_FMU_PARAMETERS(X) {places}
"""


def _compute_token(files: Mapping[str, bytes], experiment: Experiment | None) -> str:
    digest = hashlib.sha256(b"" if experiment is None else experiment.compute_digest())
    for name, data in sorted(files.items()):
        digest.update(name.encode() + b"\0" + data)
    return f"{{{uuid.UUID(bytes=digest.digest()[:16])}}}"


def _compile_binaries(
    name: str, sources: Mapping[str, bytes], options: BuildOptions
) -> dict[str, bytes]:
    folders = _FOLDERS[options.version]
    here = detect_platform()
    wanted: Sequence[tuple[Platform, Platform | None]]
    if options.platforms:
        wanted = [(each, each) for each in options.platforms]
    else:
        wanted = [(here, None)] if here in folders else []
    built = {}
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        for file, data in sources.items():
            (folder / file).write_bytes(data)
        paths = [folder / file for file in sources if file.endswith(".c")]
        for platform, target in wanted:
            library = folder / f"{name}{platform.suffix}"
            compile_library(paths, library, target)
            built[f"binaries/{folders[platform]}/{library.name}"] = library.read_bytes()
    return built


def _build_description(header: Header) -> bytes:
    root = ET.Element("fmiBuildDescription", fmiVersion="3.0")
    configuration = ET.SubElement(root, "BuildConfiguration", modelIdentifier=header.identifier)
    files = ET.SubElement(configuration, "SourceFileSet", language="C99")
    for name in header.sources:
        ET.SubElement(files, "SourceFile", name=name)
    return format_document(root).encode()


def _build_archive(files: Mapping[str, bytes]) -> bytes:
    """Zip without times, so that the same contents are the same bytes."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in sorted(files.items()):
            info = zipfile.ZipInfo(name, date_time=(1980, 1, 1, 0, 0, 0))
            info.compress_type = zipfile.ZIP_DEFLATED
            info.external_attr = 0o644 << 16
            archive.writestr(info, data)
    return buffer.getvalue()

"""Types of the compiled part; what everything is, its docstrings say."""

import os
from collections.abc import Mapping, Sequence
from typing import Any, Literal, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

_Floats = NDArray[np.float64]
_Triple = Sequence[float] | _Floats
# position (3,), m, and unit quaternion (4,), w x y z
_Pose = tuple[_Triple, _Triple]
_Path = str | os.PathLike[str]

@final
class Body:
    @staticmethod
    def from_mesh(
        path: _Path,
        scale: float = 1.0,
        stiffness: float | None = None,
        repair: Literal["strict", "near_side"] = "strict",
        centre: bool = False,
        tolerance: float | None = None,
    ) -> Body: ...
    @staticmethod
    def from_vertices(
        vertices: ArrayLike,
        faces: ArrayLike,
        stiffness: float | None = None,
        parts: Sequence[tuple[str, _Triple, _Triple, Sequence[float]]] = ...,
        tolerance: float | None = None,
    ) -> Body: ...
    @property
    def error(self) -> float: ...
    @staticmethod
    def sphere(radius: float, stiffness: float | None = None) -> Body: ...
    @staticmethod
    def box(size: _Triple, stiffness: float | None = None) -> Body: ...
    @staticmethod
    def cylinder(radius: float, length: float, stiffness: float | None = None) -> Body: ...
    @staticmethod
    def capsule(radius: float, length: float, stiffness: float | None = None) -> Body: ...
    @property
    def mesh(self) -> tuple[_Floats, NDArray[np.int64]]: ...
    @property
    def triangles(self) -> int: ...
    def copy(self) -> Body: ...

@final
class Skin:
    def __new__(
        cls,
        rows: int = 10,
        cols: int = 10,
        pitch: float = 0.015,
        *,
        electrode: float | None = None,
        cells: int = 6,
        stiffness: float | None = None,
        thickness: float | None = None,
        damping: float | None = None,
        friction: float | None = None,
    ) -> Skin: ...
    @staticmethod
    def cylinder(
        radius: float,
        rows: int,
        cols: int,
        *,
        span: tuple[float, float],
        axis: str = "z",
        arc: tuple[float, float] = ...,
        centre: _Triple = ...,
        points: int = 2,
        stiffness: float | None = None,
        thickness: float | None = None,
        damping: float | None = None,
        friction: float | None = None,
    ) -> Skin: ...
    @staticmethod
    def wrap(
        mesh: Body,
        rows: int,
        cols: int,
        *,
        span: tuple[float, float] | None = None,
        axis: str = "z",
        arc: tuple[float, float] = ...,
        centre: _Triple = ...,
        points: int = 2,
        stiffness: float | None = None,
        thickness: float | None = None,
        damping: float | None = None,
        friction: float | None = None,
    ) -> Skin: ...
    @staticmethod
    def from_points(
        positions: ArrayLike,
        normals: ArrayLike,
        areas: ArrayLike,
        *,
        taxels: ArrayLike | None = None,
        rows: int | None = None,
        cols: int | None = None,
        stiffness: float | None = None,
        thickness: float | None = None,
        damping: float | None = None,
        friction: float | None = None,
    ) -> Skin: ...
    def touch(
        self, poses: Mapping[Body, _Pose], twists: Mapping[Body, _Triple] | None = None, dt: float = 0.0
    ) -> Touch: ...
    @property
    def thickness(self) -> float: ...
    @property
    def foam(self) -> tuple[float, float]: ...
    @property
    def damping(self) -> float: ...
    def covers(self, place: Sequence[float]) -> bool: ...
    def reset(self) -> None: ...
    @property
    def shape(self) -> tuple[int, int]: ...
    @property
    def positions(self) -> _Floats: ...
    @property
    def normals(self) -> _Floats: ...
    @property
    def areas(self) -> _Floats: ...
    @property
    def time(self) -> float: ...

@final
class Touch:
    @staticmethod
    def from_array(skin: Skin, pressure: ArrayLike, dt: float = 0.1) -> Touch: ...
    @property
    def pressure(self) -> _Floats: ...
    @property
    def wrenches(self) -> dict[Body, tuple[_Floats, _Floats]]: ...
    @property
    def area(self) -> float: ...
    @property
    def time(self) -> float: ...
    @property
    def number(self) -> int: ...
    @property
    def bottomed(self) -> bool: ...

@final
class Wire:
    def __new__(
        cls,
        skin: Skin | Sequence[Skin],
        readout: str = "as_built",
        seeds: str | Sequence[int] | None = None,
        seed: int = 0,
        *,
        session: int = 0,
        levels: str | None = None,
        transducer: str = "velostat",
        parameters: Mapping[str, Any] | None = None,
        faults: Sequence[Mapping[str, Any]] | None = None,
        taxels: Sequence[int] | None = None,
        rows: ArrayLike | str | None = None,
    ) -> Wire: ...
    def feel(self, touch: Touch | ArrayLike | Sequence[Touch | None], dt: float | None = None) -> None: ...
    def record(
        self,
        touch: Touch | ArrayLike | Sequence[Touch | None],
        measurements: int | None = None,
        *,
        raster: bool = False,
        raw: bool = False,
        weights: bool = True,
        dt: float | None = None,
    ) -> tuple[_Floats, _Floats | None]: ...
    @property
    def conductance(self) -> _Floats: ...
    @property
    def idle(self) -> float: ...
    @property
    def shape(self) -> tuple[int, int]: ...
    @property
    def sample_rate(self) -> float: ...

@final
class Decoder:
    def __new__(
        cls,
        name: str,
        shape: tuple[int, int],
        images: _Floats | None = None,
        labels: NDArray[np.int64] | None = None,
        surface: tuple[ArrayLike, ArrayLike] | None = None,
    ) -> Decoder: ...
    def decode(self, phi: _Floats, y: _Floats) -> _Floats: ...
    def decode_all(self, phi: _Floats, y: _Floats) -> tuple[_Floats, NDArray[np.int64]]: ...
    @property
    def name(self) -> str: ...
    @property
    def shape(self) -> tuple[int, int]: ...

@final
class ImageClassifier:
    def __new__(cls, images: _Floats, labels: NDArray[np.int64], sparsity: int = ...) -> ImageClassifier: ...
    def classify(self, images: _Floats) -> NDArray[np.int64]: ...

@final
class Mount:
    def __new__(
        cls,
        skin: Skin,
        link: int,
        frame: Sequence[float],
        bodies: Sequence[tuple[int, Body]],
        roots: Sequence[int],
        data: Any,
    ) -> Mount: ...
    def supports(
        self, step: float, elliptic: bool, passed: Sequence[int] = ..., lined: Sequence[tuple[int, float, float]] = ...
    ) -> tuple[_Floats, list[int], list[tuple[int, float]]]: ...
    def hold(self, step: float, forces: _Floats) -> None: ...
    def release(self) -> None: ...
    def catch_up(self, last: Touch | None) -> Touch | None: ...

@final
class Mounts:
    def __new__(
        cls,
        mounts: Sequence[Mount],
        own: Sequence[Sequence[bool]],
        others: Sequence[Sequence[bool]],
        geom_bodies: Sequence[int],
        worn: Sequence[Sequence[tuple[int, float, float]]],
    ) -> Mounts: ...
    def foamed(self, contact: Any, skins: Sequence[int]) -> list[int]: ...
    def read(
        self,
        dt: float,
        contact: Any,
        forces: _Floats,
        elliptic: bool,
        foamed: int,
        springs: Sequence[tuple[int, int]],
        still: Sequence[tuple[int, int, Sequence[float]]],
    ) -> list[tuple[int, Touch]]: ...

@final
class Session:
    @property
    def name(self) -> str: ...
    @property
    def object(self) -> str: ...
    @property
    def event(self) -> str: ...
    @property
    def hold(self) -> tuple[float, float] | None: ...
    @property
    def shape(self) -> tuple[int, int] | None: ...
    @property
    def simulated(self) -> bool: ...
    @staticmethod
    def from_frames(
        frames: ArrayLike,
        rate: float,
        unit: str = "relative",
        *,
        rows: int | None = None,
        cols: int | None = None,
        pitch: float = 0.015,
        name: str = "frames",
        object: str | None = None,
        idle: int | None = None,
        hold: tuple[float, float] | None = None,
        cut: bool = False,
    ) -> Session: ...
    @property
    def frames(self) -> _Floats | None: ...
    def wire(
        self,
        readout: str = "as_built",
        *,
        seeds: str | Sequence[int] | None = None,
        rows: ArrayLike | str | None = None,
        seed: int = 1,
        session: int = 0,
        peak: float = 30e3,
    ) -> Session: ...
    def write(self, path: _Path) -> None: ...
    @property
    def raster(self) -> Recording | None: ...
    @property
    def compressive(self) -> Recording | None: ...

@final
class Recording:
    @property
    def sample_rate(self) -> float: ...
    @property
    def conditioning(self) -> int: ...
    @property
    def volts(self) -> _Floats: ...
    @property
    def idle(self) -> _Floats: ...
    def phi(self, block: int, start: int, count: int) -> _Floats: ...
    def windows(
        self, block: int, measurements: int, start: float | None = None, count: int = 1
    ) -> tuple[_Floats, _Floats]: ...
    @property
    def pressure(self) -> _Floats | None: ...
    @property
    def conductance(self) -> _Floats | None: ...
    @property
    def force(self) -> _Floats: ...
    @property
    def time(self) -> _Floats: ...
    def __len__(self) -> int: ...

@final
class DataFolder:
    @staticmethod
    def open(folder: _Path, files: _Path) -> DataFolder: ...
    @staticmethod
    def begin(spec: str, folder: _Path, overrides: Mapping[str, Any]) -> DataFolder: ...
    def make(self, shard: int) -> int: ...
    def finish(self) -> str: ...
    def info(self) -> str: ...
    def columns(self) -> str: ...
    @property
    def spec(self) -> str: ...
    def rows_of(self, shard: int) -> tuple[int, int]: ...
    @property
    def shape(self) -> tuple[int, int]: ...
    def read(self, names: Sequence[str], start: int, stop: int) -> dict[str, ArrayLike]: ...
    def volts(self, codes: NDArray[np.int64]) -> _Floats: ...
    def phi(self, first_rows: Sequence[int], measurements: int) -> _Floats: ...

def load(path: _Path) -> list[Session]: ...
def auto_decoder(rows: int, cols: int) -> str: ...
def decoder_table() -> list[tuple[str, str, str]]: ...
def support_scores(images: _Floats, truths: _Floats) -> tuple[_Floats, _Floats]: ...
def score_sessions(
    path: _Path,
    decoders: Sequence[str],
    given: Sequence[tuple[str, Any]],
    measurements: Sequence[int],
    objects: Sequence[str],
    left_out: bool,
    learn_from: str,
    sensing: Sequence[str],
    times: bool,
    seed: int,
) -> tuple[str, str]: ...
def command_line(arguments: Sequence[_Path]) -> int: ...
def shipped_specs() -> list[str]: ...
def look_in(folder: _Path) -> None: ...
def open_mujoco() -> None: ...
def simulate(scene: str, set: Mapping[str, Any], out: _Path) -> list[str]: ...

"""Saved models: the same back, refused when damaged, nothing executed."""

from __future__ import annotations

import json
import os
import pickle

import numpy as np
import pytest
from safetensors.numpy import load_file, save_file

import fogml
from fogml.errors import InputError
from fogml.models.names import make_model
from fogml.models.saved import load_model, save_model
from fogml.testing.models import synthetic_run


@pytest.fixture(scope="module")
def train():
    return synthetic_run("train", 2.0)


@pytest.fixture(scope="module")
def model(train):
    return make_model("polynomial").fit(train)


@pytest.fixture
def folder(model, tmp_path):
    save_model(model, tmp_path / "model")
    return tmp_path / "model"


def test_typical_weights_are_a_few_hundred_bytes(folder, model):
    document = json.loads((folder / "model.json").read_text())
    assert document["bytes"] == model.describe()["bytes"] == 8 * document["parameters"] <= 300
    assert (folder / "weights.safetensors").stat().st_size < 600
    assert sorted(os.listdir(folder)) == ["model.json", "weights.safetensors"]


def test_file_states_what_the_model_is(folder, train):
    document = json.loads((folder / "model.json").read_text())
    assert document["schema"] == "fogml.model/1" and document["kind"] == "polynomial"
    card = document["card"]
    assert card["unit"] == "CHECK-1" and card["axis"] == "x" and card["gyro_unit"] == "deg/h"
    assert card["runs"] == [{"name": "train", "sha256": train.hash}]
    assert card["fogml_version"] == fogml.__version__
    assert set(card["box"]) == {"T", "dT"}
    low, high = card["box"]["T"]
    assert low == train.temperature()[127:].min() and high == train.temperature()[127:].max()


def test_same_fit_gives_the_same_bytes(train, folder, tmp_path):
    save_model(make_model("polynomial").fit(train), tmp_path / "again")
    for name in os.listdir(folder):
        assert (folder / name).read_bytes() == (tmp_path / "again" / name).read_bytes()


def test_model_json_names_the_folder(folder, model, train):
    assert np.array_equal(load_model(folder / "model.json").predict(train), model.predict(train))


def test_loaded_model_can_be_fitted_again(folder, model, train):
    loaded = load_model(folder)
    assert np.array_equal(loaded.fit(train).predict(train), model.predict(train))


@pytest.mark.parametrize("name", ["model.json", "weights.safetensors"])
@pytest.mark.parametrize("share", [0.0, 0.3, 0.99])
def test_file_cut_short_is_told(folder, name, share):
    content = (folder / name).read_bytes()
    (folder / name).write_bytes(content[: int(share * len(content))])
    with pytest.raises(InputError, match=name.replace(".", r"\.")):
        load_model(folder)


@pytest.mark.parametrize("name", ["model.json", "weights.safetensors"])
def test_missing_file_is_told(folder, name):
    (folder / name).unlink()
    with pytest.raises(InputError, match="no such file"):
        load_model(folder)


def test_missing_folder_is_told(tmp_path):
    with pytest.raises(InputError, match=r"no such file.*fogml train"):
        load_model(tmp_path / "nowhere")


def test_one_flipped_bit_is_told(folder):
    content = bytearray((folder / "weights.safetensors").read_bytes())
    content[-3] ^= 1
    (folder / "weights.safetensors").write_bytes(content)
    with pytest.raises(InputError, match="damaged"):
        load_model(folder)


def test_weights_of_another_model_are_told(folder, train, tmp_path):
    save_model(make_model("M1").fit(train), tmp_path / "other")
    os.replace(tmp_path / "other" / "weights.safetensors", folder / "weights.safetensors")
    with pytest.raises(InputError, match="of another model"):
        load_model(folder)


def edited(folder, edit):
    document = json.loads((folder / "model.json").read_text())
    edit(document)
    (folder / "model.json").write_text(json.dumps(document))
    return folder


@pytest.mark.parametrize(
    ("edit", "told"),
    [
        (lambda d: d.update(schema="fogml.model/9"), "fogml.model/9"),
        (lambda d: d.update(extra=1), "unknown key 'extra'"),
        (lambda d: d.pop("card"), "'card' is missing"),
        (lambda d: d.update(form="os"), "form 'os'"),
        (lambda d: d["model"].pop("features"), "not a whole saved model"),
        (lambda d: d["model"]["regressor"].update(form="eval"), "form 'eval'"),
        (lambda d: d["card"].update(colour="red"), "not a whole saved model"),
        (lambda d: d["card"]["box"].pop("T"), "no bounds of T"),
        (lambda d: d["interval"]["levels"].pop(), "not a whole saved model"),
        (lambda d: d["model"].update(features="T, d("), "model"),
        (lambda d: d["model"].update(features="T"), "model"),
        (lambda d: d.update(card=None), "not a whole saved model"),
    ],
)
def test_document_that_is_not_right_is_told(folder, edit, told):
    with pytest.raises(InputError, match=told):
        load_model(edited(folder, edit))


@pytest.mark.parametrize("content", [b"[]", b"null", b"\xff\xfe\x00", b'{"schema": 1}', b"PK\x03\x04"])
def test_other_files_are_told(folder, content):
    (folder / "model.json").write_bytes(content)
    with pytest.raises(InputError, match=r"model\.json"):
        load_model(folder)


class Payload:
    def __reduce__(self):
        return os.mkdir, ("executed",)


def test_pickle_is_never_read(folder, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("model.json", "weights.safetensors"):
        (folder / name).write_bytes(pickle.dumps(Payload()))
        with pytest.raises(InputError):
            load_model(folder)
    assert not (tmp_path / "executed").exists()


def test_failed_write_leaves_what_was_there(folder, model, train, monkeypatch):
    before = {name: (folder / name).read_bytes() for name in os.listdir(folder)}

    def fail(*_arguments, **_keywords):
        raise OSError("disk full")

    monkeypatch.setattr("pathlib.Path.write_bytes", fail)
    with pytest.raises(OSError, match="disk full"):
        save_model(make_model("M1").fit(train), folder)
    monkeypatch.undo()
    assert {name: (folder / name).read_bytes() for name in os.listdir(folder)} == before


class TestScikitLearn:
    @pytest.fixture
    def folder(self, train, tmp_path):
        save_model(make_model("sklearn.linear_model.BayesianRidge").fit(train), tmp_path / "model")
        return tmp_path / "model"

    def swap(self, folder, data):
        import hashlib

        weights = folder / "weights.safetensors"
        assert set(load_file(weights)) == {"skops"}
        save_file({"skops": np.frombuffer(data, dtype=np.uint8)}, weights)
        digest = hashlib.sha256(weights.read_bytes()).hexdigest()
        edited(folder, lambda document: document.update(weights_sha256=digest))

    def test_comes_back(self, folder, train):
        assert np.isfinite(load_model(folder).predict(train)).all()

    def test_foreign_types_are_refused(self, folder, tmp_path, monkeypatch):
        import skops.io

        monkeypatch.chdir(tmp_path)
        self.swap(folder, skops.io.dumps(Payload()))
        with pytest.raises(InputError, match="not scikit-learn's"):
            load_model(folder)
        assert not (tmp_path / "executed").exists()

    def test_foreign_function_inside_scikit_learns_type_is_refused(self, folder):
        import skops.io
        from sklearn.preprocessing import FunctionTransformer

        self.swap(folder, skops.io.dumps(FunctionTransformer(os.system)))
        with pytest.raises(InputError, match="not scikit-learn's"):
            load_model(folder)

    def test_damaged_archive_is_told(self, folder):
        data = load_file(folder / "weights.safetensors")["skops"].tobytes()
        self.swap(folder, data[: len(data) // 2])
        with pytest.raises(InputError, match="cannot be read"):
            load_model(folder)

    def test_another_type_than_a_regressor_is_refused(self, folder):
        import skops.io
        from sklearn.preprocessing import StandardScaler

        self.swap(folder, skops.io.dumps(StandardScaler()))
        with pytest.raises(InputError, match="regressor"):
            load_model(folder)

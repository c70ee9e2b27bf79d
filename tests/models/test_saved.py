"""Saved models: the same back, refused when damaged, nothing executed."""

from __future__ import annotations

import hashlib
import io
import json
import os
import pickle
import shutil
import warnings
import zipfile

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from safetensors.numpy import load_file, save_file

import fogml
from fogml.errors import InputError
from fogml.features.features import Features
from fogml.json_files import content_hash
from fogml.models.compensation import compensate_blocks
from fogml.models.feature_model import FeatureModel
from fogml.models.linear import LinearRegressor
from fogml.models.names import make_model
from fogml.models.rbf import RBFRegressor
from fogml.models.saved import load_model, model_to_saved, save_model
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
    assert document["schema"] == "fogml.model/2" and document["kind"] == "polynomial"
    card = document["card"]
    assert card["unit"] == "CHECK-1" and card["axis"] == "x" and card["gyro_unit"] == "deg/h"
    assert card["runs"] == [{"name": "train", "sha256": train.hash}]
    assert card["fogml_version"] == fogml.__version__
    assert set(card["box"]) == {"T", "dT"}
    low, high = card["box"]["T"]
    assert low == train.temperature()[16:].min() and high == train.temperature()[16:].max()


def test_same_fit_gives_the_same_bytes(train, folder, tmp_path):
    save_model(make_model("polynomial").fit(train), tmp_path / "again")
    for name in os.listdir(folder):
        assert (folder / name).read_bytes() == (tmp_path / "again" / name).read_bytes()


def test_model_json_names_the_folder(folder, model, train):
    assert np.array_equal(load_model(folder / "model.json").predict(train), model.predict(train))


@pytest.mark.parametrize(
    ("name", "parameters"),
    [("polynomial", {"ridge": np.float32(0.5)}), ("sklearn.svm.SVR", {"max_iter": np.int64(9000)})],
)
def test_parameters_may_be_numbers_of_numpy(train, tmp_path, name, parameters):
    fitted = make_model(name, "T", parameters=parameters).set_params(max_rows=np.int64(100)).fit(train)
    save_model(fitted, tmp_path / "model")
    again = load_model(tmp_path / "model")
    np.testing.assert_array_equal(again.predict(train), fitted.predict(train))
    assert type(again.max_rows) is int


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
    with pytest.raises(InputError, match="of two models"):
        load_model(folder)


def edited(folder, edit=lambda _: None, arrays=None):
    """The folder with other content and the hash of that: as somebody would make it who knows the form."""
    document = json.loads((folder / "model.json").read_text())
    edit(document)
    if arrays is not None:
        save_file(arrays, folder / "weights.safetensors")
    document.pop("sha256", None)
    weights = {"weights.safetensors": (folder / "weights.safetensors").read_bytes()}
    document["sha256"] = content_hash(document, weights)
    (folder / "model.json").write_text(json.dumps(document))
    return folder


def test_layout_of_the_document_does_not_matter(folder, model, train):
    assert np.array_equal(load_model(edited(folder)).predict(train), model.predict(train))


def test_the_hash_is_over_the_whole_document_and_the_weights(folder):
    document = json.loads((folder / "model.json").read_text())
    stated = document.pop("sha256")
    text = json.dumps(document, sort_keys=True, separators=(",", ":"))
    weights = (folder / "weights.safetensors").read_bytes()
    content = f'{text}\n"weights.safetensors" {len(weights)}\n'.encode() + weights
    assert stated == hashlib.sha256(content).hexdigest()


@pytest.mark.parametrize(
    "edit",
    [
        lambda d: d["card"].update(unit="FOG-2"),
        lambda d: d["card"].update(gyro_unit="count"),
        lambda d: d["card"].update(sample_s=20.0),
        lambda d: d["card"]["box"].update(T=[-100.0, 100.0]),
        lambda d: d["card"].update(rows=d["card"]["rows"] + 0.0),
        lambda d: d.update(kind="M2"),
        lambda d: d["interval"]["half_widths"].reverse(),
        lambda d: d.update(sha256=d["card"]["runs"][0]["sha256"]),
        lambda d: d.update(sha256=None),
        lambda d: d.pop("sha256"),
    ],
)
def test_whatever_is_edited_is_told(folder, edit):
    document = json.loads((folder / "model.json").read_text())
    edit(document)
    (folder / "model.json").write_text(json.dumps(document))
    with pytest.raises(InputError, match="changed, cut short or damaged after"):
        load_model(folder)


@given(st.sampled_from(["model.json", "weights.safetensors"]), st.data())
@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
def test_a_flipped_bit_never_gives_another_model(folder, model, train, name, data):
    path = folder / name
    content = path.read_bytes()
    place, bit = data.draw(st.integers(0, len(content) - 1)), data.draw(st.integers(0, 7))
    flipped = bytearray(content)
    flipped[place] ^= 1 << bit
    path.write_bytes(flipped)
    try:
        loaded = load_model(folder)
    except InputError:
        pass
    else:
        # Space between the words of the document.
        assert model_to_saved(loaded)[0] == model_to_saved(model)[0]
        assert np.array_equal(loaded.predict(train), model.predict(train))
    finally:
        path.write_bytes(content)


def test_a_model_without_the_hash_of_earlier_versions_is_told(folder):
    edited(folder, lambda document: document.update(schema="fogml.model/1"))
    with pytest.raises(InputError, match="kept no hash of the whole model; train it again"):
        load_model(folder)


def of_the_first_version(document):
    document["card"]["fogml_version"] = "0.1.0"


@pytest.mark.parametrize(("features", "span_s"), [("T, dT", 128), ("T, dT[exp, 50 s]", 150)])
def test_a_model_whose_windows_gave_nothing_until_they_were_full_says_so(train, tmp_path, features, span_s):
    save_model(FeatureModel(features, LinearRegressor()).fit(train), tmp_path)
    with pytest.warns(UserWarning, match=f"made by fogml 0.1.0, .* first {span_s} s .*; train it again"):
        loaded = load_model(edited(tmp_path, of_the_first_version))
    # As 0.1.0 predicts: without a rate while the window fills.
    T, rate = (Features(text).transform(train)[:, 0] for text in features.split(", ", 1))
    rate[train.time < train.time[0] + span_s - 1.0] = 0.0
    first = loaded.regressor_.intercept_ + np.column_stack([T, rate]) @ loaded.regressor_.coef_
    off = np.abs(loaded.predict(train) - first) > 1e-9
    assert off.any() and train.time[off].max() < train.time[0] + span_s


@pytest.mark.parametrize("features", ["T, T^2", "T, dT[first]", "T, lag(T, 60 s)"])
def test_a_model_of_the_first_version_without_windows_says_nothing(train, tmp_path, features):
    save_model(FeatureModel(features, LinearRegressor()).fit(train), tmp_path)
    assert load_model(edited(tmp_path, of_the_first_version)).card_.fogml_version == "0.1.0"


@pytest.mark.parametrize(
    ("edit", "told"),
    [
        (lambda d: d.update(schema="fogml.model/9"), "fogml.model/9"),
        (lambda d: d.update(extra=1), "key 'extra'"),
        (lambda d: d.pop("card"), "key 'card': Field required"),
        (lambda d: d.update(form="os"), "form 'os'"),
        (lambda d: d.update(form=3), "key 'form': .*string"),
        (lambda d: d.update(kind='x */ #include "y"'), "is no model of form 'features'"),
        (lambda d: d.update(kind="joint"), "is no model of form 'features'"),
        (lambda d: d.update(form="joint", kind="joint"), "key 'model"),
        (lambda d: d.update(form="sklearn"), "key 'model"),
        (lambda d: d.update(parameters=7), "not those of the weights"),
        (lambda d: d.update(bytes=True), "key 'bytes'"),
        (lambda d: d["model"].pop("features"), "key 'model.features'"),
        (lambda d: d["model"].update(features=["T"]), "key 'model.features'"),
        (lambda d: d["model"].update(max_rows="10"), "key 'model.max_rows'"),
        (lambda d: d["model"]["regressor"].pop("form"), "form None"),
        (lambda d: d["model"]["regressor"].update(form=["linear"]), "form"),
        (lambda d: d["model"]["regressor"].update(form="skops"), "does not belong"),
        (lambda d: d["model"]["regressor"].update(form="rbf"), "key 'regressor"),
        (lambda d: d["model"]["regressor"].update(ridge="1"), "key 'regressor.ridge"),
        (lambda d: d["model"]["regressor"].update(rank=True), "key 'regressor.rank'"),
        (lambda d: d["model"]["regressor"].update(fit_intercept=1), "key 'regressor.fit_intercept'"),
        (lambda d: d["model"]["regressor"]["standard_errors"].pop(), "array 'coef' is"),
        (
            lambda d: d["model"]["regressor"]["standard_errors"].append("0"),
            "key 'regressor.standard_errors.6'",
        ),
        (lambda d: d["model"]["regressor"].update(form="eval"), "form 'eval'"),
        (lambda d: d["card"].update(colour="red"), "key 'card.colour'"),
        (lambda d: d["card"].update(sample_s="1.0"), "key 'card.sample_s'"),
        (lambda d: d["card"].update(sample_s=True), "key 'card.sample_s'"),
        (lambda d: d["card"].update(sample_s=0), "key 'card.sample_s'"),
        (lambda d: d["card"].update(unit=417), "key 'card.unit'"),
        (lambda d: d["card"].update(gyro_unit="deg/s"), "key 'card.gyro_unit'"),
        (lambda d: d["card"].update(earth_known="yes"), "key 'card.earth_known'"),
        (lambda d: d["card"]["runs"][0].update(sha256="*/ x"), "key 'card.runs.0.sha256'"),
        (lambda d: d["card"]["box"].update(T=[50.0, 0.0]), "low not above high"),
        (lambda d: d["card"]["box"].update(T=["0", "50"]), "key 'card.box.T.0'"),
        (lambda d: d["card"]["box"].update(T=[0.0]), "key 'card.box.T.1'"),
        (lambda d: d["card"]["box"].pop("T"), "no bounds of T"),
        (lambda d: d["interval"]["levels"].pop(), "do not match"),
        (lambda d: d["interval"]["levels"].__setitem__(0, 0.99), "do not match"),
        (lambda d: d["interval"]["half_widths"].__setitem__(0, -1), "key 'interval.half_widths.0'"),
        (lambda d: d["interval"].update(averaging_s=0.0), "key 'interval.averaging_s'"),
        (lambda d: d["model"].update(features="T, d("), "model"),
        (lambda d: d["model"].update(features="T"), "model"),
        (lambda d: d.update(card=None), "key 'card'"),
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


COEF = np.array([0.1, 0.2, 0.3, 0.4, 0.5])


@pytest.mark.parametrize(
    ("arrays", "told"),
    [
        ({"coef": COEF}, "'intercept' is missing"),
        ({"coef": COEF, "intercept": np.zeros(1), "more": np.zeros(1)}, "'more' does not belong"),
        ({"coef": COEF[:4], "intercept": np.zeros(1)}, "'coef' is float64 of shape .4,."),
        ({"coef": COEF[:, None], "intercept": np.zeros(1)}, "'coef' is"),
        ({"coef": COEF, "intercept": np.zeros(())}, "'intercept' is"),
        ({"coef": COEF.astype(np.float32), "intercept": np.zeros(1)}, "'coef' is float32"),
        ({"coef": COEF.astype(np.int32), "intercept": np.zeros(1)}, "'coef' is of type I32"),
        ({"coef": COEF > 0.2, "intercept": np.zeros(1)}, "'coef' is of type BOOL"),
        ({"coef": COEF.astype(np.float16), "intercept": np.zeros(1)}, "'coef' is of type F16"),
        ({"coef": COEF * np.nan, "intercept": np.zeros(1)}, "'coef' holds a number that is not finite"),
        ({"coef": COEF, "intercept": np.array([-np.inf])}, "'intercept' holds a number"),
    ],
)
def test_weights_that_are_not_right_are_told(folder, arrays, told):
    with pytest.raises(InputError, match=told):
        load_model(edited(folder, arrays=arrays))


def test_brain_floats_are_told(folder):
    header = json.dumps({"coef": {"dtype": "BF16", "shape": [2], "data_offsets": [0, 4]}}).encode()
    (folder / "weights.safetensors").write_bytes(len(header).to_bytes(8, "little") + header + bytes(4))
    with pytest.raises(InputError, match="'coef' is of type BF16"):
        load_model(edited(folder))


def test_numbers_that_are_too_large_are_told_with_their_time(folder, train):
    arrays = {name: array.copy() for name, array in load_file(folder / "weights.safetensors").items()}
    arrays["coef"][2] = 1e308
    model = load_model(edited(folder, arrays=arrays))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for use in (model.predict, model.compensate, lambda run: list(compensate_blocks(model, [run]))):
            with pytest.raises(InputError, match=r"^train: at time \d+ s the model's drift is"):
                use(train)


def test_only_registered_kinds_are_saved(train, tmp_path):
    model = FeatureModel("T", LinearRegressor(), kind="my own").fit(train)
    with pytest.raises(InputError, match="kind 'my own' is no model of form 'features'"):
        save_model(model, tmp_path / "model")
    assert not (tmp_path / "model").exists()


@pytest.mark.parametrize(
    "edit",
    [
        lambda d: d.update(kind="others"),
        lambda d: d["model"]["regressor"].update(form="others"),
        lambda d: d["model"].update(features="T, others(T)"),
        lambda d: d["model"].update(features="T, dT[others, 60 s]"),
    ],
)
def test_what_a_package_that_is_not_installed_declares_asks_for_it(folder, edit):
    with pytest.raises(InputError, match="'others'") as raised:
        load_model(edited(folder, edit))
    # To train it again asks for the package just as well.
    assert str(raised.value).endswith("; install the package that declares it")


@pytest.fixture(scope="module")
def network(train):
    regressor = RBFRegressor(centres=4, tune=False, average_rows=200, prune=0.0)
    return FeatureModel("T, dT, T*dT", regressor, kind="rbf").fit(train)


class TestNetwork:
    @pytest.mark.parametrize(
        ("edit", "told"),
        [
            (lambda r: r["columns"].__setitem__(-1, 3), "there are inputs 0 to 2"),
            (lambda r: r["columns"].__setitem__(0, -1), "there are inputs 0 to 2"),
            (lambda r: r["columns"].append(r["columns"][-1]), "there are inputs 0 to 2"),
            (lambda r: r["columns"].__setitem__(0, 0.0), "key 'regressor.columns.0'"),
            (lambda r: r["edge_columns"].append(10**9), "there are inputs 0 to 2"),
            (lambda r: r["fitted"].update(n_features_in_=10**6), "array 'linear' is"),
            (lambda r: r["fitted"].update(weights_dtype_="float16"), "weights_dtype_"),
            (lambda r: r["fitted"].update(notes_="note"), "notes_"),
            (lambda r: r["fitted"].pop("spread_"), "spread_"),
            (lambda r: r["parameters"].update(device="foo"), "parameter 'device' is 'foo'"),
            (lambda r: r["parameters"].update(threads=10.5), "parameter 'threads' is 10.5"),
            (lambda r: r["parameters"].update(eval=1), "no parameter 'eval'"),
        ],
    )
    def test_what_kernels_index_by_is_checked(self, network, tmp_path, edit, told):
        save_model(network, tmp_path / "model")
        with pytest.raises(InputError, match=told):
            load_model(edited(tmp_path / "model", lambda d: edit(d["model"]["regressor"])))

    @pytest.mark.parametrize("name", ["widths", "centres", "weights", "linear"])
    def test_arrays_are_checked(self, network, tmp_path, name):
        save_model(network, tmp_path / "model")
        arrays = load_file(tmp_path / "model" / "weights.safetensors")
        arrays[name] = np.zeros_like(arrays[name]) if name == "widths" else arrays[name][1:]
        with pytest.raises(InputError, match=f"array '.*({name}|weights|centres)'"):
            load_model(edited(tmp_path / "model", arrays=arrays))


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


@pytest.fixture(scope="module")
def kept(train, tmp_path_factory):
    folder = tmp_path_factory.mktemp("kept") / "model"
    save_model(make_model("sklearn.linear_model.BayesianRidge").fit(train), folder)
    return folder


class TestScikitLearn:
    @pytest.fixture
    def folder(self, kept, tmp_path):
        return shutil.copytree(kept, tmp_path / "model")

    def swap(self, folder, data):
        assert set(load_file(folder / "weights.safetensors")) == {"skops"}
        edited(
            folder,
            lambda document: document.update(bytes=len(data)),
            arrays={"skops": np.frombuffer(data, dtype=np.uint8)},
        )

    def test_comes_back(self, folder, train):
        assert np.isfinite(load_model(folder).predict(train)).all()

    def test_foreign_types_are_refused(self, folder, tmp_path, monkeypatch):
        import skops.io

        monkeypatch.chdir(tmp_path)
        self.swap(folder, skops.io.dumps(Payload()))
        with pytest.raises(InputError, match="none of scikit-learn's regressors needs"):
            load_model(folder)
        assert not (tmp_path / "executed").exists()

    def test_foreign_function_inside_scikit_learns_type_is_refused(self, folder):
        import skops.io
        from sklearn.preprocessing import FunctionTransformer

        self.swap(folder, skops.io.dumps(FunctionTransformer(os.system)))
        with pytest.raises(InputError, match="none of scikit-learn's regressors needs"):
            load_model(folder)

    def test_damaged_archive_is_told(self, folder):
        data = load_file(folder / "weights.safetensors")["skops"].tobytes()
        self.swap(folder, data[: len(data) // 2])
        with pytest.raises(InputError, match="cannot be read"):
            load_model(folder)

    def test_what_unpacks_to_more_than_it_is_is_refused(self, folder):
        packed = io.BytesIO()
        with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr("schema.json", " " * (1 << 20))
        self.swap(folder, packed.getvalue())
        with pytest.raises(InputError, match="unpacks to more than it is"):
            load_model(folder)

    def test_another_type_than_a_regressor_is_refused(self, folder):
        import skops.io
        from sklearn.preprocessing import StandardScaler

        self.swap(folder, skops.io.dumps(StandardScaler()))
        with pytest.raises(InputError, match="regressor"):
            load_model(folder)


def test_results_of_a_training_name_their_model(folder, model, train):
    assert np.array_equal(load_model(folder.parent).predict(train), model.predict(train))


def test_a_file_in_the_place_of_the_folder_is_told(tmp_path):
    (tmp_path / "report.html").write_text("x")
    with pytest.raises(InputError, match=r"report\.html: is a file; name the folder that"):
        load_model(tmp_path / "report.html")

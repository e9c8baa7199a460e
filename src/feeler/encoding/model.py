"""ConvolutiveNMF: the encoder, as a scikit-learn estimator, what it accepts, and its files."""

import os
import warnings
from dataclasses import replace
from itertools import count
from pathlib import Path
from pkgutil import resolve_name
from typing import Any

import numpy as np
from joblib import effective_n_jobs
from sklearn.base import BaseEstimator, TransformerMixin
from sklearn.exceptions import ConvergenceWarning
from sklearn.utils.validation import check_is_fitted

from feeler.encoding.code import encode_masked
from feeler.encoding.convolution import (
    canonicalise,
    canonicalise_sums,
    compute_activation_gram,
    compute_stability,
    match_components,
    reconstruct,
)
from feeler.encoding.factorise import (
    Data,
    Factors,
    Settings,
    draw_starts,
    factorise,
    learn_batch,
    make_generators,
    open_pool,
    start_bases,
)
from feeler.encoding.inputs import (
    FIXED_CODES,
    check_choice,
    check_settings,
    check_size,
    check_tensors,
    read_tensors,
    read_weights,
)
from feeler.errors import FeelerError, InvalidInput, StoreError
from feeler.progress import show_progress
from feeler.records import show_html
from feeler.tensors.formats import Model, load_model, save_model
from feeler.tensors.transforms import (
    check_axes,
    check_squares,
    find_dims,
    find_scale,
    label_like,
    read_axes,
    refuse_masked,
)
from feeler.validation import checked

# ConvolutiveNMF: the encoder, as a scikit-learn estimator.

_SHOWN = ("relative_residual_", "stability_", "n_iter_", "n_sensors_in_")
_OF_FIT = (
    *("activations_", "reconstruction_err_", "relative_residual_", "n_iter_", "loss_curve_"),
    *("stability_", "stability_in_place_", "restarts_", "restart_components_"),
    "restart_activations_",
)
"""What only ``fit`` knows of its tensors; learning from a batch leaves none of it true."""
_NEARLY = 0.003  # [C] share of the squares
_Sums = tuple[np.ndarray | float, np.ndarray | float]


class ConvolutiveNMF(  # type: ignore[call-arg]
    TransformerMixin, BaseEstimator, auto_wrap_output_keys=None
):
    """Convolutive non-negative matrix factorisation with exactly sparse activations (cNMFsc).

    Every tensor becomes a sum of a few bases. A basis is a short film of the antenna, which is
    played whenever its activation says so:

        V_n(x, t) ≈ Σ_m Σ_τ W_m(x, τ) H_nm(t − τ),   τ = 0 … n_lags − 1,   W ≥ 0, H ≥ 0.

    The fit lowers ½ Σ_n ‖V_n − V̂_n‖² and never raises it. The activations take projected-gradient
    steps with Hoyer's exact projection, row by row, in single precision; a step is accepted only if
    the loss falls. Then, in double precision, each entry of the bases goes to its best value. An
    iteration begins further along the last one's change. After 5, 10, 20 and 40 of them a fit whose
    bases are where a wider window of lags says that their patterns begin goes on beside, and in its
    place if it is ahead after five iterations. No trial runs into the next.

    Parameters
    ----------
    n_components : int, default=3
        Number of bases, M. The paper shows 2 to 5, and works with 3.
    n_lags : int, default=40
        Samples that a basis lasts, T. The paper has 40 samples of 1 ms.
    sparseness : float or None, default=0.8
        Hoyer sparseness of the activations, in [0, 1); the paper has 0.8. None is plain convolutive
        NMF with multiplicative updates and nothing else; with ``n_lags=1`` it is scikit-learn's
        ``NMF(solver="mu")``, step for step.
    constraint : {"trial", "all"}, default="trial"
        ``trial`` gives every trial's activation of every component this sparseness, or makes it
        zero. ``all`` gives it to the activation of each component over all trials together, as if
        the tensors were one recording; then how sparse a trial's code is depends on the others.
        Only with ``trial`` does the code of a tensor depend on the tensor alone.
    cross_orthogonality : float, default=0.0
        Weight λ of seqNMF's penalty λ Σ_{k≠m} Σ_t Σ_{|u|<T} A_k(t) H_m(t + u); A_k(t) is basis k
        correlated with the tensors from t on, of their entries that count. Bases then do not share
        events, and needless ones fade. It has no unit; seqNMF's authors find 10⁻³ to 10⁻² useful.
    code : {"sparse", "ridge", "nonnegative"}, optional
        What ``transform`` computes on the fixed bases; see :func:`feeler.encoding.encode`. None:
        ``sparse`` with a sparseness, otherwise ``nonnegative``.
    ridge : float, default=0.1
        Weight of the ridge, relative to the squared length of a basis.
    init : {"random", "windows"}, default="random"
        ``random`` starts from uniform numbers. ``windows`` starts from stretches of the tensors
        drawn by energy: this start is nearer, but planted bases come back less often from it.
    n_restarts : int, default=3
        Fits from this many starts.
    n_finished : int, optional
        How many of these fits, those of lowest loss, go on past a third of ``max_iter``, which
        halves the time of ten; ``restarts_`` and stabilities then speak of unfinished fits too.
        None: all.
    keep : {"lowest", "typical"}, default="lowest"
        Which start is kept: the one of the lowest loss, or, of those that leave at most 0.3 % [C]
        more of the squares unexplained, the one whose bases are most like all the others'. The
        lowest of many starts is at times one that splits a pattern and mixes two others.
    max_iter : int, default=100
        Most iterations of a fit.
    tol : float, default=3e-4
        A fit ends when over ten iterations the loss falls by less than ``tol`` times itself per
        iteration (times 10⁻⁴ of the tensors' energy, once it is lower than that).
    inner_steps : int, optional
        Steps of the activations, and of the bases, per iteration. None: 10 under a sparseness, 1
        without.
    random_state : int, np.random.Generator or np.random.RandomState, optional
        Seed or generator of the starts.
    n_jobs : int, optional
        Threads, as scikit-learn counts them: None is one, unless joblib's ``parallel_config`` says
        another number, and −1 is all. The numbers do not depend on it.
    warn : bool, default=True
        Whether to warn when a fit or a code stops before it has converged.

    Attributes
    ----------
    components_ : np.ndarray
        Bases (component, sensor, lag) of unit length, from base to tip by where they act.
    n_sensors_in_, n_features_in_ : int
        Sensors that the bases were learned on, by both names.
    activations_ : np.ndarray
        Activations (trial, component, time) found together with the bases. They are not unique, so
        codes to compare come from ``transform``; ``fit_transform`` returns those too.
    reconstruction_err_ : float
        ‖V − V̂‖, Frobenius, in the tensors' unit, over the entries that count, each trial with its
        weight.
    relative_residual_ : float
        ‖V − V̂‖/‖V‖, likewise.
    n_iter_ : int
        Iterations of the restart kept.
    loss_curve_ : np.ndarray
        What the fit lowers, after each of them: ½‖V − V̂‖², the penalty added; under a mask an upper
        bound of it, where entries that do not count are held at their last reconstruction.
    stability_, stability_in_place_ : float
        Mean cosine between the restarts' bases, matched over order and shift, and over order alone;
        NaN for one restart. Where only the first is high, restarts found the same patterns at other
        lags, and some may hold a part of a pattern only: compare ``restarts_``.
    restarts_ : np.ndarray
        Relative residual of each restart, the one kept first, then from the best.
    restart_components_, restart_activations_ : np.ndarray, list of np.ndarray
        Their bases and activations, in the same order.

    Notes
    -----
    ``fit`` and ``fit_stream`` start anew; ``partial_fit`` goes on from whatever came before. All
    attributes but the first two describe the tensors of one ``fit``, and are absent after
    ``partial_fit`` and ``fit_stream``.

    References
    ----------
    Smaragdis 2004, LNCS 3195:494 (convolutive NMF). Hoyer 2004, J. Mach. Learn. Res. 5:1457
    (sparseness). Ramanarayanan, Goldstein & Narayanan 2013, J. Acoust. Soc. Am. 134:1378 (cNMFsc).
    Lee & Seung 2001, NIPS 13 (multiplicative updates). Cichocki & Phan 2009, IEICE Trans. Fundam.
    E92-A:708 (entry by entry). Gillis & Glineur 2012, Neural Comput. 24:1085 (several inner steps).
    Ang & Gillis 2019, Neural Comput. 31:417 (extrapolation). Mackevicius et al. 2019, eLife
    8:e38471 (cross-orthogonality). Zhang, Wang, Ford & Makedon 2006, SDM, 549 (masked entries).
    """

    def __init__(
        self,
        n_components: int = 3,
        n_lags: int = 40,
        sparseness: float | None = 0.8,
        *,
        constraint: str = "trial",
        cross_orthogonality: float = 0.0,
        code: str | None = None,
        ridge: float = 0.1,
        init: str = "random",
        n_restarts: int = 3,
        n_finished: int | None = None,
        keep: str = "lowest",
        max_iter: int = 100,
        tol: float = 3e-4,
        inner_steps: int | None = None,
        random_state: int | np.random.Generator | np.random.RandomState | None = None,
        n_jobs: int | None = None,
        warn: bool = True,
    ) -> None:
        self.n_components = n_components
        self.n_lags = n_lags
        self.sparseness = sparseness
        self.constraint = constraint
        self.cross_orthogonality = cross_orthogonality
        self.code = code
        self.ridge = ridge
        self.init = init
        self.n_restarts = n_restarts
        self.n_finished = n_finished
        self.keep = keep
        self.max_iter = max_iter
        self.tol = tol
        self.inner_steps = inner_steps
        self.random_state = random_state
        self.n_jobs = n_jobs
        self.warn = warn

    def _repr_mimebundle_(self, **_: object) -> dict[str, str]:
        """What a notebook shows: the bases once there are some, before that the settings."""
        rows = [*self.get_params().items()]
        figure = None
        if hasattr(self, "components_"):
            known = [name for name in _SHOWN if hasattr(self, name)]
            rows = [(name, getattr(self, name)) for name in known] + rows
            figure = self.plot()
        html = show_html(type(self).__name__, rows, figure)
        return {"text/plain": repr(self), "text/html": html}

    def _repr_html_(self) -> str:
        """The same for what asks for HTML alone."""
        return self._repr_mimebundle_()["text/html"]

    def plot(self) -> Any:
        """The learned bases as pictures: a matplotlib Figure, which notebooks show."""
        check_is_fitted(self)
        return resolve_name("feeler.plotting.results:draw_encoder")(self)

    def fit(
        self,
        X,
        y=None,
        *,
        mask=None,
        sample_weight=None,
        components=None,
        activations=None,
        progress=None,
    ):
        """Learn the bases of tensors.

        Parameters
        ----------
        X : np.ndarray, np.ma.MaskedArray or xr.DataArray
            Tensors (trial, sensor, time), ≥ 0. Of a DataArray with other dims, such as (epoch,
            neuron, time), these stand in their order for trial, sensor and time.
        y : None
            Ignored.
        mask : np.ndarray or xr.DataArray of bool, optional
            True for entries that do not count, of the shape of X: missing or held out. They may be
            NaN. A masked array brings its own. Each iteration holds them at their reconstruction
            by the last one, which lowers the loss over all others.
        sample_weight : np.ndarray, optional
            How often each trial (trial,) counts in the loss; a weight of 2 is two equal trials. A
            trial of weight 0 counts for nothing, and its ``activations_`` are 0. Under
            ``constraint="all"`` the sparseness is that of activations times √weight.
        components, activations : np.ndarray, optional
            Where to start: (component, sensor, lag) and (trial, component, time); then there is one
            restart.
        progress : Callable, optional
            Called with the number of iterations done and their number, at most, of all restarts.

        Raises
        ------
        InvalidInput
            Tensors or parameters that cannot be used, each with what to do.
        """
        check_settings(self)
        tensors, hidden = read_tensors(X, mask)
        weights = read_weights(sample_weight, len(tensors))
        check_squares(tensors)
        check_size(tensors, self.n_components, self.n_lags)
        root = None if weights is None else np.sqrt(weights)[:, None, None]
        if root is not None:
            tensors = tensors * root
            activations = None if activations is None else activations * root
        data, threads = Data(tensors, self.n_lags, hidden), _count_threads(self.n_jobs)
        starts = list(draw_starts(self, tensors, data, components, activations))
        settings, done = Settings.of(self), count(1)
        last = min(self.n_finished or len(starts), len(starts))
        most = last * self.max_iter + (len(starts) - last) * settings.halfway
        with (
            show_progress(progress, "iterations, at most") as advance,
            open_pool(threads) as run,
        ):
            # threads wait least where each has a start of its own
            outer, inner = (run, map) if len(starts) >= threads else (map, run)

            def tell(*_: object) -> None:
                advance(next(done), most)

            found = factorise(data, starts, settings, outer, inner, tell)
        self._keep([_canonical(one) for one in found], data)
        self._axes = read_axes(X)
        if root is not None:
            for codes in self.restart_activations_:
                np.divide(codes, root, out=codes, where=root > 0)
        return self

    def fit_transform(self, X, y=None, **starts):
        """``fit``, then ``transform`` of the same tensors: the same code that new tensors get."""
        return self.fit(X, y, **starts).transform(X)

    def transform(self, X, *, mask=None, code=None):
        """Activations of tensors on the fixed bases.

        Each trial is coded by itself from a fixed start: the same tensor gets the same code,
        whatever its neighbours.

        Parameters
        ----------
        X : np.ndarray, np.ma.MaskedArray or xr.DataArray
            Tensors (trial, sensor, time), ≥ 0; see ``fit``.
        mask : np.ndarray or xr.DataArray of bool, optional
            True for entries that do not count; see ``fit``.
        code : {"sparse", "ridge", "nonnegative"}, optional
            See :func:`feeler.encoding.encode`; None: that of the encoder.

        Returns
        -------
        np.ndarray or xr.DataArray
            (trial, component, time); labelled where the tensors are.
        """
        check_is_fitted(self, "components_")
        tensors, hidden = read_tensors(X, mask)
        check_tensors(tensors, self.components_)
        check_axes(X, getattr(self, "_axes", {}))
        code = code or self.code or ("nonnegative" if self.sparseness is None else "sparse")
        check_choice("code", code, FIXED_CODES)
        if code == "sparse" and self.sparseness is None:
            raise InvalidInput(
                "The sparse code needs a sparseness; set one, or choose code='ridge' or"
                " 'nonnegative'."
            )
        with open_pool(_count_threads(self.n_jobs)) as run:
            activations, settled = encode_masked(
                tensors,
                hidden,
                self.components_,
                code,
                sparseness=self.sparseness,
                ridge=self.ridge,
                run=run,
            )
        if not settled and self.warn:
            warnings.warn(
                f"The {code} code of some trial still moved when it was stopped; it may be less"
                " than the best. The ridge code with a larger ridge is better posed.",
                ConvergenceWarning,
                stacklevel=3,
            )
        trial, _, time = find_dims(X)
        return label_like(_like(activations, X), X, (trial, "component", time), "activation")

    def __sklearn_tags__(self):
        """Tensors come in three dimensions and are nowhere negative."""
        tags = super().__sklearn_tags__()
        tags.input_tags.two_d_array, tags.input_tags.three_d_array = False, True
        tags.input_tags.positive_only = True
        tags.transformer_tags.preserves_dtype = ["float64", "float32"]
        return tags

    @property
    def n_features_in_(self):
        """Sensors that the bases were learned on, by scikit-learn's name."""
        return self.n_sensors_in_

    def get_feature_names_out(self, input_features=None):
        """Names of the components, ``component0`` from the base on; :class:`Flatten` adds the
        sample.
        """
        check_is_fitted(self, "components_")
        return np.array([f"component{m}" for m in range(len(self.components_))], dtype=object)

    def set_output(self, *, transform=None):
        """Accepted, so that a pipeline can be configured; codes have three dims, which no table
        holds, and stay arrays until :class:`Flatten`.
        """
        return self

    def inverse_transform(self, X):
        """Tensors (trial, sensor, time) from activations (trial, component, time)."""
        check_is_fitted(self, "components_")
        refuse_masked(X)
        trial, component, time = find_dims(X)
        if hasattr(X, "indexes"):
            X = X.transpose(trial, component, time)
        activations = np.asarray(X, dtype=float)
        if activations.ndim != 3 or activations.shape[1] != len(self.components_):
            raise InvalidInput(
                f"Activations need the shape (trial, {len(self.components_)}, time); got"
                f" {activations.shape}."
            )
        return label_like(
            _like(reconstruct(self.components_, activations), X),
            X,
            (trial, "sensor", time),
            "reconstruction",
        )

    def score(self, X, y=None, *, mask=None, sample_weight=None):
        """Share of the tensors' energy that their code gives back, 1 − ‖V − V̂‖²/‖V‖², over the
        entries that count, each trial with its weight.
        """
        tensors, hidden = read_tensors(X, mask)
        check_axes(X, getattr(self, "_axes", {}))
        weights = read_weights(sample_weight, len(tensors))
        tensors = tensors / find_scale(tensors)  # squares of very small entries would underflow
        rest = tensors - self.inverse_transform(self.transform(tensors, mask=hidden))
        if hidden is not None:
            rest[hidden] = 0
        errors, energies = ((one**2).sum(axis=(1, 2)) for one in (rest, tensors))
        energy = np.average(energies, weights=weights)
        return float(1 - np.average(errors, weights=weights) / energy) if energy > 0 else 1.0

    def partial_fit(self, X, y=None, *, forget=0.7):
        """Learn from one batch of tensors (trial, sensor, time), going on from what was learned.

        What came before, be it a ``fit``, a ``fit_stream`` or earlier batches, is kept as two sums
        over its tensors; they count ``forget`` times as much as this batch. An encoder without
        bases begins with the batch. ``n_restarts`` and ``max_iter`` play no part.

        Raises
        ------
        InvalidInput
            Tensors or parameters that cannot be used; other ``n_components`` or ``n_lags`` than the
            bases have.
        """
        if hasattr(self, "components_"):
            n_components, _, n_lags = self.components_.shape
            if (n_components, n_lags) != (self.n_components, self.n_lags):
                raise InvalidInput(
                    f"The encoder has learned {n_components} bases of {n_lags} lags, but"
                    f" n_components is now {self.n_components} and n_lags {self.n_lags}. Set them"
                    " back to go on, or call fit or fit_stream, which start anew."
                )
            check_axes(X, axes := getattr(self, "_axes", {}))
            learned = self.components_, getattr(self, "_sums", (0.0, 0.0))
        else:
            learned, axes = None, {}
        self._set_bases(*self._learn_batch(X, learned, forget))
        self._axes = axes or read_axes(X)
        return self

    def fit_stream(
        self, source, *, batch_size=32, n_epochs=5, forget=0.7, prepare=None, progress=None
    ):
        """Learn from tensors that need not fit into memory, a batch of trials at a time.

        It starts anew, from bases drawn once (``n_restarts`` and ``max_iter`` play no part), reads
        the batches in their order, and ends after ``n_epochs``, converged or not. A batch that is
        refused leaves the encoder as it was.

        Parameters
        ----------
        source : array-like
            Anything with a shape (trial, sensor, time) that gives tensors when sliced over trials:
            a Zarr array, a NumPy memory map, a DataArray opened lazily. Each batch is read, checked
            and dropped.
        batch_size : int, default=32
            Trials in a batch.
        n_epochs : int, default=5
            How often all batches are read.
        forget : float, default=0.7
            What earlier batches count beside a new one.
        prepare : Callable, optional
            Applied to each batch first, for instance ``feeler.tensors.rectify`` to stored tensors,
            which are signed; with touches from the right, ``lambda X: rectify(mirror_to_left(X))``
            of a DataArray, which knows their sides.
        progress : Callable, optional
            Called with the number of batches done and their number.
        """
        if len(getattr(source, "shape", ())) != 3:
            raise InvalidInput(
                "fit_stream needs something with a shape (trial, sensor, time), such as a Zarr"
                " array."
            )
        for name, value in (("batch_size", batch_size), ("n_epochs", n_epochs)):
            if not isinstance(value, int | np.integer) or value < 1:
                raise InvalidInput(
                    f"{name} must be a whole number of at least 1; got {value!r}."
                )
        if hasattr(source, "indexes"):
            source = source.transpose(*find_dims(source))
        firsts = [*range(0, source.shape[0], batch_size)] * n_epochs
        if not firsts:
            raise InvalidInput(f"The source holds no trials: shape {source.shape}.")
        learned: Any = None
        with show_progress(progress, "batches") as advance:
            for k, first in enumerate(firsts, 1):
                batch = source[first : first + batch_size]
                batch = batch if prepare is None else prepare(batch)
                learned = self._learn_batch(batch, learned, forget)
                advance(k, len(firsts))
        self._set_bases(*learned)
        self._axes = read_axes(batch)
        return self

    def _learn_batch(
        self, X: Any, learned: tuple[np.ndarray, _Sums] | None, forget: float
    ) -> tuple[np.ndarray, _Sums]:
        """Canonical bases and sums after a batch; ``learned``: those before it, None at first."""
        check_settings(self)
        if not 0 <= forget <= 1:
            raise InvalidInput(f"forget must lie between 0 and 1; got {forget!r}.")
        refuse_masked(X)
        if self.cross_orthogonality:
            raise InvalidInput(
                "partial_fit and fit_stream know no cross_orthogonality; use fit, or set it to 0."
            )
        tensors, _ = read_tensors(X)
        check_squares(tensors)
        if learned is None or not learned[0].any():  # silent batches teach no bases
            check_size(tensors, self.n_components, self.n_lags)
            rng = make_generators(self.random_state, 1)[0]
            start = start_bases(tensors, self.n_components, self.n_lags, self.init, rng)
            learned = start, (0.0, 0.0)
        check_tensors(tensors, learned[0])
        with open_pool(_count_threads(self.n_jobs)) as run:
            components, sums = learn_batch(tensors, *learned, Settings.of(self), forget, run)
        return canonicalise_sums(components, *sums)

    def _set_bases(self, components: np.ndarray, sums: _Sums) -> None:
        """Set what was learned, without what is known of the tensors of a ``fit`` alone."""
        for name in (*_OF_FIT, "_axes"):
            self.__dict__.pop(name, None)
        self.components_, self._sums = components, sums
        self.n_sensors_in_ = components.shape[1]

    def _keep(self, found: list[Factors], data: Data) -> None:
        """Set the learned attributes from the restarts."""
        energy = data.energy
        found = sorted(found, key=lambda factors: factors.losses[-1])
        if self.keep == "typical":
            found.insert(0, found.pop(_find_typical(found, _NEARLY * energy)))
        best = found[0]
        gram = compute_activation_gram(best.activations, data.n_lags)
        self._set_bases(best.components, (data.gather(best.activations), gram))
        self.activations_ = best.activations
        self.loss_curve_, self.n_iter_ = best.losses, len(best.losses)
        errors = [data.measure_error(one.components, one.activations) for one in found]
        self.restarts_ = (
            np.sqrt(np.array(errors) / energy) if energy > 0 else np.zeros(len(found))
        )
        self.reconstruction_err_ = float(np.sqrt(errors[0]))
        self.relative_residual_ = float(self.restarts_[0])
        self.restart_components_ = np.stack([f.components for f in found])
        self.restart_activations_ = [f.activations for f in found]
        self.stability_ = compute_stability(list(self.restart_components_))
        self.stability_in_place_ = compute_stability(
            list(self.restart_components_), shift=False
        )
        if not best.converged and self.warn:
            warnings.warn(
                "The fit still improved by more than tol per iteration after max_iter iterations."
                " Raise max_iter, or tol if this residual will do.",
                ConvergenceWarning,
                stacklevel=3,
            )


class Flatten(TransformerMixin, BaseEstimator):
    """Codes or tensors (trial, row, time) as a table (trial, feature), which classifiers take.

    Its columns run through the samples of the first row, then of the second; ``component1_30`` is
    sample 30 of the second component. It learns nothing but the shape.

    Parameters
    ----------
    row : str, default="component"
        What a row is called in the names of the columns.
    """

    def __init__(self, row: str = "component") -> None:
        self.row = row

    def fit(self, X, y=None):
        """Remember the shape (row, time); others are refused later."""
        self.shape_ = self._read(X).shape[1:]
        self.n_features_in_ = self.shape_[0]
        return self

    def transform(self, X):
        """The table (trial, row · time), a view where possible."""
        check_is_fitted(self)
        values = self._read(X)
        if values.shape[1:] != self.shape_:
            raise InvalidInput(
                f"Flatten was fitted to (row, time) of {self.shape_}; got {values.shape[1:]}."
            )
        return values.reshape(len(values), -1)

    def inverse_transform(self, X):
        """The array (trial, row, time) of a table."""
        check_is_fitted(self)
        return np.asarray(X).reshape(-1, *self.shape_)

    def get_feature_names_out(self, input_features=None):
        """A name per column, from the names of the rows where they are given."""
        check_is_fitted(self)
        n_rows, n_times = self.shape_
        own = [f"{self.row}{m}" for m in range(n_rows)]
        rows = own if input_features is None else input_features
        return np.array([f"{row}_{t}" for row in rows for t in range(n_times)], dtype=object)

    def __sklearn_tags__(self):
        """Three dims in, two out, in the precision given."""
        tags = super().__sklearn_tags__()
        tags.input_tags.two_d_array, tags.input_tags.three_d_array = False, True
        tags.transformer_tags.preserves_dtype = ["float64", "float32"]
        return tags

    @staticmethod
    def _read(X: Any) -> np.ndarray:
        refuse_masked(X)
        values = np.asarray(X)
        if values.ndim != 3:
            raise InvalidInput(
                f"Flatten needs the shape (trial, row, time); got {values.shape}."
            )
        return values


def _canonical(factors: Factors) -> Factors:
    components, activations = canonicalise(factors.components, factors.activations)
    return replace(factors, components=components, activations=activations)


def _find_typical(found: list[Factors], margin: float) -> int:
    """Which of the fits within a margin of the lowest squares is most like all of them."""
    near = [one for one in found if 2 * (one.losses[-1] - found[0].losses[-1]) <= margin]
    bases = [one.components for one in near]
    return int(np.argmax([sum(match_components(a, b)[1].sum() for b in bases) for a in bases]))


def _count_threads(n_jobs: int | None) -> int:
    """As many as scikit-learn would use."""
    if n_jobs == 0:
        raise InvalidInput("n_jobs must be None, at least 1, or −1 for all cores; got 0.")
    return int(effective_n_jobs(n_jobs))


def _like(values: np.ndarray, given: Any) -> np.ndarray:
    """``values`` in single precision where ``given`` is."""
    single = getattr(given, "dtype", None) == np.float32
    return values.astype(np.float32) if single else values


# An encoder on disk: a model file, arrays beside a JSON header, no pickle.

_KIND, _VERSION = "ConvolutiveNMF", 1
_ARRAYS = ("components_", "activations_", "loss_curve_", "restarts_", "restart_components_")
_SUMS = ("sum_seen", "sum_gram")
"""From which ``partial_fit`` goes on."""
_NUMBERS = (
    *("reconstruction_err_", "relative_residual_", "n_iter_", "n_sensors_in_"),
    *("stability_", "stability_in_place_"),
)


@checked
def save_encoder(encoder: ConvolutiveNMF, path: str | os.PathLike) -> Path:
    """Write a fitted encoder; the file appears whole or not at all.

    Raises
    ------
    StoreError
        The encoder is not fitted.
    """
    if not hasattr(encoder, "components_"):
        raise StoreError("The encoder has no bases yet: fit it before saving.")
    parameters = encoder.get_params()
    if not isinstance(parameters["random_state"], int | None):
        parameters["random_state"] = None  # a generator has no lasting name
    arrays = {
        name: np.asarray(getattr(encoder, name))
        for name in _ARRAYS + _NUMBERS
        if hasattr(encoder, name)
    } | dict(zip(_SUMS, getattr(encoder, "_sums", ()), strict=False))
    save_model(
        Model(
            kind=_KIND,
            version=_VERSION,
            arrays=arrays,
            settings={"parameters": parameters, "axes": getattr(encoder, "_axes", {})},
        ),
        path,
    )
    return Path(path)


@checked
def load_encoder(path: str | os.PathLike, *, trusted: bool = False) -> ConvolutiveNMF:
    """Read an encoder that :func:`save_encoder` wrote.

    Parameters
    ----------
    path : str or os.PathLike
        The file.
    trusted : bool, default=False
        Skip the guard, for a file of your own.

    Raises
    ------
    StoreError
        No such file, another kind or version, or arrays that do not fit together.
    """
    if not Path(path).exists():
        raise StoreError(f"There is no file {path}.")
    try:
        model = load_model(path, kind=_KIND, version=_VERSION, trusted=trusted)
    except InvalidInput as error:
        raise StoreError(
            f"{path} is not an encoder of feeler, or is damaged ({error}). Save it again."
        ) from error
    return _rebuild(path, model)


def _rebuild(path: str | os.PathLike, model: Model) -> ConvolutiveNMF:
    """The estimator from a model, or a word on what does not fit."""
    try:
        encoder = ConvolutiveNMF(**model.settings["parameters"])
        check_settings(encoder)
        numbers = {name: model.arrays[name].item() for name in _NUMBERS if name in model.arrays}
        components = model.arrays["components_"]
        n_sensors = numbers["n_sensors_in_"]
    except (KeyError, TypeError, ValueError, AttributeError, FeelerError) as error:
        raise StoreError(
            f"{path} lacks parts of an encoder ({error}). Save it again."
        ) from error
    # n_components and n_lags may have been set to other numbers after the fit
    if (
        components.ndim != 3
        or components.shape[1] != n_sensors
        or not np.isfinite(components).all()
        or (components < 0).any()
    ):
        raise StoreError(
            f"The bases in {path} should be (component, {n_sensors}, lag), finite and non-negative;"
            f" got {components.shape}."
        )
    _check_beside(path, components.shape, model.arrays)
    for name, value in (
        {name: model.arrays[name] for name in _ARRAYS if name in model.arrays} | numbers
    ).items():
        setattr(encoder, name, value)
    encoder._axes = model.settings.get("axes", {})
    if all(name in model.arrays for name in _SUMS):
        encoder._sums = model.arrays[_SUMS[0]], model.arrays[_SUMS[1]]
    return encoder


def _check_beside(path: str | os.PathLike, shape: tuple[int, ...], arrays: dict) -> None:
    """Refuse arrays that do not belong to bases of this shape (component, sensor, lag)."""
    n_components, _, n_lags = shape
    found = {name: np.shape(arrays[name]) for name in arrays}
    expected = {
        "activations_": (*found.get("activations_", ())[:1], n_components),
        "restart_components_": (*found.get("restart_components_", ())[:1], *shape),
        "sum_seen": shape,
        "sum_gram": (n_components, n_lags, n_components, n_lags),
    }
    for name, own in expected.items():
        if name in found and found[name][: len(own)] != own:
            raise StoreError(
                f"The array {name} in {path} has the shape {found[name]}, which does not go with"
                f" bases of {shape}. Save it again."
            )

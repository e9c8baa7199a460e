"""A linear decoder for the board itself, as a C header."""

import json
from operator import itemgetter
from typing import Any

import numpy as np
from sklearn.discriminant_analysis import LinearDiscriminantAnalysis
from sklearn.model_selection import PredefinedSplit, cross_val_predict

from feeler.decoding.classifiers import number_labels
from feeler.robot.decoder import RobotDecoder
from feeler.robot.description import list_lengths

_WINDOWS = (200, 400, 800)  # [C] ms after contact, of which the most accurate is taken
_BIN = 20  # [C] ms that are averaged to one number
_FOLDS = 4  # [C] as of the classifier of untruncated touches


def _list(values: np.ndarray) -> str:
    return ", ".join(f"{value:.8e}f" for value in values)


def make_board_decoder(decoder: RobotDecoder) -> tuple[str, float, int]:
    """A linear discriminant of the decoder's own training set, from contact on.

    It learns the samples after contact alone, at which a board needs no peak to be found. Scores =
    weights · means + bias, of the means of 20 ms of every sensor since contact.

    Returns
    -------
    header : str
        Weights, and ``feeler_push``, which takes a sample each ms and gives the number of the class
        once the window is over.
    accuracy : float
        Share of held-out touches of surrogate robots that were classified correctly.
    window : int
        Samples of 1 ms after contact that are used.
    """
    watch: Any = decoder.stream.watch_
    means, y, groups, _ = watch.classifiers_[max(watch.classifiers_)]._training
    classes = decoder.stream.classes_
    labels = number_labels(y, classes)
    folds = np.unique(groups, return_inverse=True)[1] % _FOLDS
    pair = _BIN // decoder.classifier.step
    longest = means.shape[2] * decoder.classifier.step
    found = []
    for window in (w for w in _WINDOWS if w <= longest):
        count = window // _BIN
        binned = means[:, :, : count * pair].reshape(len(means), means.shape[1], count, pair)
        flat = binned.mean(axis=3).transpose(0, 2, 1).reshape(len(means), -1)
        guessed = cross_val_predict(_make_lda(), flat, labels, cv=PredefinedSplit(folds))
        found.append((float(np.mean(guessed == labels)), window, flat))
    share, window, flat = max(found, key=itemgetter(0))
    fitted = _make_lda().fit(flat, labels)
    weights, bias = fitted.coef_, fitted.intercept_
    if len(fitted.classes_) == 2:  # scikit-learn gives two classes one row
        weights, bias = np.vstack([-weights, weights]) / 2, np.hstack([-bias, bias]) / 2
    lengths = list_lengths(decoder.antenna)
    names = (classes[k] for k in fitted.classes_)
    header = _HEADER.format(
        sensors=lengths.size,
        classes=len(fitted.classes_),
        window=window,
        bin=_BIN,
        bins=window // _BIN,
        onset=f"{decoder.stream.onset:.9g}f",
        confirm=decoder.stream.confirm,
        names=", ".join(json.dumps(f"{feature} {x:g} {v:g}") for feature, x, v in names),
        lengths=_list(lengths),
        weights=",\n".join("{" + _list(row) + "}" for row in weights),
        bias=_list(bias),
        accuracy=f"{share:.1%}",
    )
    return header, share, window


def _make_lda() -> LinearDiscriminantAnalysis:
    return LinearDiscriminantAnalysis(solver="lsqr", shrinkage="auto")


_HEADER = """\
/* Linear decoder of touches, written by feeler; {accuracy} of held-out touches of simulated robots
   are classified correctly. Angles are in rad, one sample each ms, base to tip.

   static feeler_touch touch;                     all zero at the start
   int which = feeler_push(&touch, angle);        -1: not yet; -2: not known, as an angle of the
                                                  touch was no number; else feeler_names[which]
   feeler_reset(&touch);                          before the next touch                       */
#ifndef FEELER_DECODER_H
#define FEELER_DECODER_H
#include <math.h>
#include <string.h>

#define FEELER_SENSORS {sensors}
#define FEELER_CLASSES {classes}
#define FEELER_WINDOW {window} /* samples after contact */
#define FEELER_BIN {bin}
#define FEELER_BINS {bins}

static const char *const feeler_names[FEELER_CLASSES] = {{{names}}};
static const float feeler_lengths[FEELER_SENSORS] = {{{lengths}}}; /* mm */
static const float feeler_bias[FEELER_CLASSES] = {{{bias}}};
static const float feeler_weights[FEELER_CLASSES][FEELER_BINS * FEELER_SENSORS] = {{
{weights}}};

typedef struct {{
  float level[FEELER_SENSORS]; /* resting angles */
  float mean[FEELER_BINS * FEELER_SENSORS];
  float tip[FEELER_WINDOW];
  int seen, running, since, begun;
}} feeler_touch;

static inline void feeler_reset(feeler_touch *touch) {{ memset(touch, 0, sizeof *touch); }}

/* Whether contact is noticed with this sample; else the resting level is followed. */
static int feeler_notice(feeler_touch *touch, const float *angle) {{
  float away, most = 0;
  int n;
  for (n = 0; n < FEELER_SENSORS; n++) if (isnan(angle[n])) return 0;
  if (!touch->begun) memcpy(touch->level, angle, sizeof touch->level);
  touch->begun = 1;
  for (n = 0; n < FEELER_SENSORS; n++) most = fmaxf(most, fabsf(angle[n] - touch->level[n]));
  touch->running = most > {onset} ? touch->running + 1 : 0;
  if (most <= {onset}) {{
    touch->seen++;
    for (n = 0; n < FEELER_SENSORS; n++) {{
      away = angle[n] - touch->level[n];
      touch->level[n] += away / fminf((float)touch->seen, 300.0f);
    }}
  }}
  return touch->running >= {confirm};
}}

static inline int feeler_push(feeler_touch *touch, const float angle[FEELER_SENSORS]) {{
  int n, k, c, best = 0, past = touch->since >= FEELER_WINDOW;
  float turn = 0, tip = 0, most = 0, score, top = 0, sign = 1;
  if (past || (touch->running < {confirm} && !feeler_notice(touch, angle))) return -1;
  for (n = 0; n < FEELER_SENSORS; n++) {{
    float away = angle[n] - touch->level[n];
    turn += away;
    tip += feeler_lengths[n] * sinf(turn);
    touch->mean[touch->since / FEELER_BIN * FEELER_SENSORS + n] += away / FEELER_BIN;
  }}
  touch->tip[touch->since++] = tip;
  if (touch->since < FEELER_WINDOW) return -1;
  for (k = 0; k < FEELER_WINDOW; k++) most = fmaxf(most, fabsf(touch->tip[k]));
  for (k = 0; k < FEELER_WINDOW && fabsf(touch->tip[k]) <= most / 2; k++) {{}}
  if (k < FEELER_WINDOW && touch->tip[k] < 0) sign = -1; /* from the other side: its mirror image */
  for (c = 0; c < FEELER_CLASSES; c++) {{
    score = feeler_bias[c];
    for (k = 0; k < FEELER_BINS * FEELER_SENSORS; k++)
      score += sign * feeler_weights[c][k] * touch->mean[k];
    if (isnan(score)) return -2;
    if (c == 0 || score > top) {{ top = score; best = c; }}
  }}
  return best;
}}
#endif
"""

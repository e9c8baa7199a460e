"""The paper's Methods in their order, a call a paragraph; what MATLAB needs to check it goes to
recipe.mat: ``python paper/recipe.py``.
"""

import numpy as np
from scipy.io import savemat
from sklearn.decomposition import PCA
from sklearn.discriminant_analysis import LinearDiscriminantAnalysis

import feeler
from feeler.analysis import INDICES, compute_dispersion
from feeler.decoding.classifiers import make_labels
from feeler.encoding import compute_histogram_entropy
from feeler.objects import Relative

# "Generation of tactile tensors": 6 features, 5 places, 3 speeds; a sample each ms for 380 ms
tensors = feeler.touch(feeler.presets.cockroach(), feeler.presets.paper_trials())
angles, speeds = feeler.tensors.rectify(tensors["angle"].values), tensors["speed"].values
labels = make_labels(tensors)
# "Spatiotemporal encoding": cNMFsc, sparseness 0.8, bases of 40 ms; M = 3 as in Fig. 4D and 5F
encoder = feeler.ConvolutiveNMF(3, n_lags=40, sparseness=0.8, random_state=0).fit(angles)
bases, codes = encoder.components_, encoder.activations_
print("entropy:", [float(compute_histogram_entropy(one / one.max())) for one in bases])
# "Dataset dispersion evaluation": each tensor's closest match within its speed, averaged
found = compute_dispersion({speed: angles[speeds == speed] for speed in np.unique(speeds)})
for index in INDICES:
    print(index, {str(v): one.estimate for v, one in found.average[index].items()})
# "Feature classification": first PCA of the flattened activations, 30 features, ~90 % …
flat = codes.reshape(len(codes), -1)
pca, rng = PCA(30).fit(flat), np.random.default_rng(0)
print("variance kept:", pca.explained_variance_ratio_.sum())
for speed in np.unique(speeds):  # … then noise relative to each vector's maximum, the same PCA
    own, names = flat[speeds == speed], np.tile(labels[speeds == speed], 10)
    train, test = (pca.transform(Relative(0.15).add(own, rng, 10)) for _ in range(2))
    lda = LinearDiscriminantAnalysis().fit(train, names)
    print(f"LDA, {speed:g} m/s, 15 % noise: {lda.score(test, names):.3f}")
content = {"tensors": angles, "bases": bases, "activations": codes, "speeds": speeds}
savemat("recipe.mat", content | {"labels": labels.astype(object)}, do_compression=True)

// Fabrics, by their constants in SI units: cantilevers, drape, sag; garments.
#pragma once

#include "tests/bench/accuracy/quantities.h"

namespace drape::bench {

// Strips of cotton, denim, silk and card clamped at one end (Peirce's cantilever), at three
// overhangs, of 8, 16 and 32 cells each; at one of them as irregular meshes too.
std::vector<QuantityScene> CantileverScenes(bool is_quick);

// Sheets, shirts and dresses made by rule (tests/support/garments.h), hung and damped: percentiles
// of |strain|, which should be small.
std::vector<QuantityScene> GarmentScenes(bool is_quick);

// Squares of 30 cm on a round table of 18 cm, as grids and as meshes: the share of the overhanging
// area that is left in the shadow from above (Cusick's drape coefficient). A rigid board keeps
// all, a fabric as much as its finest grid.
std::vector<QuantityScene> DrapeScenes(bool is_quick);

// 1 m of cotton hung by two corners 0.9 m apart, at rest: how deep its first row sags, and its mean
// height. As at the finest resolution, and as at the shortest time step.
std::vector<QuantityScene> SagScenesBySide(bool is_quick);
std::vector<QuantityScene> SagScenesByStep(bool is_quick);

}  // namespace drape::bench

// Barycentric coordinates, of one triangle or of four at once: Vector as in four_vectors.h.
#pragma once

#include <array>

#include "server/solver/surface_contact/four_vectors.h"

namespace drape::surface_contact {

// Of the point of the triangle's plane that is nearest to x.
template <class Vector>
std::array<NumberOf<Vector>, 3> WeightsAt(const std::array<Vector, 3>& corners, const Vector& x) {
  using Number = NumberOf<Vector>;
  const Vector e = corners[1] - corners[0], f = corners[2] - corners[0], d = x - corners[0];
  const Number ee = Dot(e, e), ef = Dot(e, f), ff = Dot(f, f), de = Dot(d, e), df = Dot(d, f);
  const Number determinant = ee * ff - ef * ef;
  const Number v = (ff * de - ef * df) / determinant, w = (ee * df - ef * de) / determinant;
  return {1 - v - w, v, w};
}

// All weights are above `least`.
template <class Number>
MaskOfNumber<Number> AreInside(const std::array<Number, 3>& weights, double least) {
  const auto its = OfAll<Number>(least);
  return (weights[0] > its) & (weights[1] > its) & (weights[2] > its);
}

}  // namespace drape::surface_contact

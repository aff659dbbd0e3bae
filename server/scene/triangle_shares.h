// How the triangles of a cloth share its particles, for forces on triangles.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace drape {

// The triangles of particle i are the entries offsets[i] .. offsets[i + 1] of `triangles`,
// ascending.
struct TriangleShares {
  std::vector<uint32_t> offsets;    // [particle_count + 1]
  std::vector<uint32_t> triangles;  // [3 * triangle_count]
  // The mass on which an impulse on a triangle may act, a third of it at each corner,
  // [triangle_count]. Each particle divides its mass among its triangles by their areas; the mass
  // of a triangle is three times the smallest of its corners' shares, so no particle gives more
  // than its mass. In a mesh of uniform density it is the mass of the triangle itself.
  std::vector<double> masses_kg;
};

// Smallest mass of a triangle [kg]: it has no effect, and its reciprocal is within single
// precision.
inline constexpr double kMinTriangleMass_kg = 1e-30;

// `masses_kg` of the particles, pins included. Linear time.
TriangleShares ShareTriangles(std::span<const Eigen::Vector3d> rest_positions_m,
                              std::span<const double> masses_kg,
                              std::span<const std::array<uint32_t, 3>> triangles);

}  // namespace drape

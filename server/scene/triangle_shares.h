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
  // Area that stands for each particle over that of its triangles, [particle_count]; a third where
  // each corner has a third of each triangle. An impulse on a triangle acts on its corners by these
  // shares.
  std::vector<double> corner_shares;
  // The area of each triangle times the least mass per area of its corners, [triangle_count]. So
  // no particle gives its triangles more than its mass: the sum of masses_kg times its corner share
  // is at most that. In a cloth of uniform density it is the mass of the triangle itself.
  std::vector<double> masses_kg;
};

// Which area stands for a particle.
enum class ParticleAreas {
  kThirds,  // a third of each of its triangles: particles of a uniform mesh weigh so
  kEqual,   // the same for all particles with triangles: those of a uniform grid weigh the same
};

// Smallest mass of a triangle [kg]: it has no effect, and its reciprocal is within single
// precision.
inline constexpr double kMinTriangleMass_kg = 1e-30;

// `masses_kg` of the particles, pins included. Linear time.
TriangleShares ShareTriangles(std::span<const Eigen::Vector3d> rest_positions_m,
                              std::span<const double> masses_kg,
                              std::span<const std::array<uint32_t, 3>> triangles,
                              ParticleAreas areas);

}  // namespace drape

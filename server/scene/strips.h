// Paths along the constraints: the constraints of a path are solved together, as one tridiagonal
// system, instead of one after the other.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "server/core/interruption.h"
#include "server/scene/description.h"

namespace drape {

// A longer path is cut: its solve is sequential.
inline constexpr uint32_t kMaxStripLinks = 1024;

// Masses of linked particles are unequal from this ratio on [-]. Smaller: more cloths take up to
// twice the time; larger: cloths gain energy (tests/bench/notes/solver.md).
inline constexpr double kUnequalMassRatio = 10;

// The phases there have every constraint in exactly one strip; those behind are some of the same
// phases again (AddWaysBack). Strip s has the links [strip_offsets[s],
// strip_offsets[s + 1]): link k is constraint constraints[k], between two neighbours of the path
// whose particles are particles[strip_offsets[s] + s] and on, one more than it has links. No
// particle occurs twice in a strip. Phase f has the strips [phase_offsets[f], phase_offsets[f +
// 1]); no two strips of a phase share a particle, unless it is a pin: those are only read.
struct StripSet {
  std::vector<uint32_t> phase_offsets{0};  // [phase_count + 1]
  std::vector<uint32_t> strip_offsets{0};  // [strip_count + 1]
  std::vector<uint32_t> constraints;       // [constraint_count] indices into the constraints
  std::vector<uint32_t> particles;         // [constraint_count + strip_count]
  uint32_t phase_count_there = 0;

  uint32_t phase_count() const { return static_cast<uint32_t>(phase_offsets.size()) - 1; }
  uint32_t strip_count() const { return static_cast<uint32_t>(strip_offsets.size()) - 1; }
};

// At every particle the edges that continue each other most straightly in the rest shape are
// joined, less than 70 degrees from straight, those of a chain always. This cuts the graph into
// paths: the rows and columns of a grid, the three directions of a regular triangle mesh, a chain
// as a whole. Paths go into the first phase they fit, longest first. Deterministic; about linear in
// the constraints. Without ways back. `is_pin`: [particle_count]. `interruption`: asked now and
// then; null: nobody is.
StripSet FindStrips(std::span<const Eigen::Vector3d> rest_positions_m,
                    std::span<const DistanceConstraint> constraints,
                    const std::vector<bool>& is_pin, Interruption* interruption = nullptr);

// How often a sweep has to come back through its phases: 0, 1 or 2 times. The errors that a sweep
// there and back leaves are mapped by a symmetric matrix, whose eigenvalues are real and within [0,
// 1): the only ones that neither one step nor two make grow. One way has such by itself with one or
// two phases of alike masses. With three or more phases they are complex, and rigid links that are
// redundant, or between unequal masses, gain energy. Twice where a particle that nothing but a
// strip holds, or one of a tree, is much lighter than both neighbours there: it whips, far from the
// linearisation of one solve. Compliant links need none. `inverse_masses_per_kg`: [particle_count],
// 0: pins.
uint32_t WaysBack(const StripSet& strips, std::span<const DistanceConstraint> constraints,
                  std::span<const double> inverse_masses_per_kg);
// Adds `count` times all phases there but the last, in reverse, and between them all but the first:
// for three phases 0 1 2 | 1 0 | 1 2 1 0. A single phase is added `count` times.
void AddWaysBack(uint32_t count, StripSet& strips);

// Whether every particle is a pin or on a strip that has one, and no strip has two, between which
// it could be pulled beyond any weight: a chain by its end, a sheet by a whole edge. `is_pin`:
// [particle_count].
bool HangsByStrips(const StripSet& strips, const std::vector<bool>& is_pin);

// Whether each strip is a span: two or more of its particles are pins, which may hold it taut.
// [strip_count]; empty if none is. `is_pin`: [particle_count].
std::vector<bool> FindSpans(const StripSet& strips, const std::vector<bool>& is_pin);

}  // namespace drape

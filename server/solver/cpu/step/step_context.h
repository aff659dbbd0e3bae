// The data of a step: the state, the working memory and the substep under way.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "server/core/interruption.h"
#include "server/solver/bodies/bodies.h"
#include "server/solver/collider_contact.h"
#include "server/solver/cpu/model/float_controls.h"
#include "server/solver/cpu/model/float_model.h"
#include "server/solver/cpu/model/held_particles.h"
#include "server/solver/cpu/model/own_lengths.h"
#include "server/solver/cpu/simd/simd_memory.h"
#include "server/solver/cpu/step/clearance.h"
#include "server/solver/cpu/step/collider_reach.h"
#include "server/solver/cpu/step/collider_surface.h"
#include "server/solver/cpu/step/impulse_sums.h"
#include "server/solver/cpu/step/refine.h"
#include "server/solver/cpu/step/step_team.h"
#include "server/solver/substep_schedule.h"

namespace drape {
class ContactSurface;
class SurfaceParts;
}  // namespace drape

namespace drape::cpu {

// Positions [m] and velocities [m/s], [particle_count + 1] each; the last one, the spare particle,
// and lane 3 of all stay 0.
struct FloatState {
  std::vector<Vec4> positions;
  std::vector<Vec4> velocities;
};

// Whether a step that begins in this state carries remainders
// (SolverChoice::remainder_speed_m_per_s).
bool HasRemainders(const SolverChoice& solver, const FloatState& state);

// The impulses of one collider on one particle in this substep, times w.
struct ContactImpulses {
  Vec4 tangent;
  float normal;
  float floor;    // lowest accepted gap [m]
  float rebound;  // speed with which the particle leaves if it hits [m/s]
  float unused;   // fills two vectors
};

// A substep in single precision (solver/substep_schedule.h). While it lasts the positions of the
// working state are b, and the velocities u.
struct FloatSubstep {
  FloatSubstep() = default;
  FloatSubstep(const Substep& substep, double damping_per_s);

  float interval = 0;          // H [s]
  float half_interval = 0;     // H / 2 [s]
  float inverse_interval = 0;  // 1 / H [1/s]
  float link_interval = 0;     // Substep::link_interval_s [s]
  float inverse_link_interval = 0;
  float force_time = 0;          // Substep::force_s [s]
  float inverse_force_time = 0;  // 1 / Substep::force_s [1/s]
  bool is_two_step = false;
  bool is_last = false;
  float pin_shares = 1;
  float inverse_duration = 0;  // [1/s]
  float pin_lead = 0;          // 1 - H / duration: how far on its way the b of a pin is
  float kick_before = 0;       // [s]
  float kick_after = 0;
  float kick_within = 0;
  float lead = 0;  // [s]
  float twist_share = 0;
  bool finds_hinges = true;
  float hinge_interval = 0;  // H + Substep::hinge_lead_s [s]
  float damping_factor = 1;  // of velocities: of v after a ballistic substep, of u before two steps
};

// Working memory of one group of strips or lines of elastic elements.
struct StripScratch {
  SimdMemory links;
  SimdMemory end_directions;              // of the links; only with start directions
  std::vector<uint32_t> stretched_links;  // places that refinement found
};

struct SelfContactMemory;     // alone/self_contacts.h
struct SurfaceContactMemory;  // alone/surface_contacts.h

// Working memory of `apply_elastic` of a grid (GridElements), by coordinates. The numbers beside
// the rows stay 0.
struct GridElasticScratch {
  void Prepare(const GridElements& grid, size_t members);
  float* ForcesOf(uint32_t member) { return forces + member * forces_of_member; }

  std::vector<float> memory;
  float* positions = nullptr;   // [row][x, y, z][pitch]
  float* velocities = nullptr;  // the same
  float* forces = nullptr;      // [member][KeptRow][x, y, z][pitch]
  size_t forces_of_member = 0;
};

// Working memory of one step; kept by a thread between steps only to save allocations.
struct StepScratch {
  FloatState state;             // the step's working copy; velocities hold u within a substep
  FloatState previous;          // the state before, two steps only
  bool has_remainders = false;  // in this step (HasRemainders)
  // With remainders only: what rounding took from each position, of b within a substep [m]; and the
  // same of the state before.
  std::vector<Vec4> remainders, previous_remainders;
  std::vector<Vec4> predicted;      // positions for kicks within a substep
  std::vector<Vec4> accelerations;  // [particle_count] springs (+ gravity if IN_FORCE)
  std::vector<Vec4> air_impulses;   // [triangle group][lane] a third of the impulse [N s]
  // [elastic group][lane][impulses_per_element] [N s]; with lines of each cell at its first
  // particle
  std::vector<Vec4> elastic_impulses;
  GridElasticScratch grid_elastic;
  // [particle_count] of velocities by the last stage [m/s], or shared [m/s^2]
  std::vector<Vec4> hinge_changes;
  // Lambda, [group_count + 1] [N s]; only with compliance or inequalities
  std::vector<Vec4> distance_impulses;
  std::vector<StripScratch> strips;  // of each member of the team
  std::vector<Vec4> twists;          // [row_count + 1][column_count + 1] of the cells around
  Refinement refinement;
  std::vector<Vec4> joint_impulses;  // Lambda, [joint_count] [N s]
  std::vector<Vec4> rest_lengths;    // [group_count] [m] at the end of the substep; only of its own
  ColliderReach reach;
  std::vector<ContactImpulses> contacts;  // [particle_count][reach.near]
  Clearances clearances;                  // of what is clear no sweep has asked for an impulse
  std::vector<float> quiet_round_offs;    // [particle_count + 1] [m]; only with quiet links
  bool has_quiet_particles = false;       // any of them is not 0
  bool something_holds = false;           // some contact, by friction, in this substep
  // [reach.near] in the substep under way; empty if all rest as described.
  std::vector<MovingSurface> surfaces;
  SimdMemory lane_colliders, lane_motions;                 // [reach.near] the same in all lanes
  std::shared_ptr<SelfContactMemory> self_contacts;        // made when a cloth first needs it
  std::shared_ptr<SurfaceContactMemory> surface_contacts;  // the same
  ImpulseSums impulses;                                    // only where they are asked for
  Bodies bodies;                                           // of the colliders
  bool self_contacts_failed = false;  // pins forced the cloth through itself in this step
  uint64_t repeats = 0;  // steps of this thread that were done again with all colliders
};

// Not fewer in a range that is one thread's (StepTeam): they take about half a microsecond, what it
// takes a thread to find a range.
inline constexpr size_t kParticleGrain = 128;
inline constexpr size_t kGroupGrain = 32;  // groups of four constraints, elements, triangles
inline constexpr size_t kBlockGrain = 32;  // blocks of tethers
inline constexpr size_t kRowGrain = 4;     // of a grid
inline constexpr size_t kStripGrain = 1;   // groups of strips

// Everything one step needs.
struct StepContext {
  const FloatModel& model;
  const FloatControls& controls;
  HeldParticles held;
  const OwnLengths* own_lengths;  // null: the rest lengths are the model's
  // From the start of the step on, [collider_count]; empty: they rest as described.
  std::span<const RigidMotion> collider_motions;
  StepScratch& scratch;
  StepTeam& team;
  uint32_t max_iterations;    // sweeps per substep at most
  bool leaves_out_colliders;  // those out of reach; the result does not depend on it
  // Of the scheme with which a step is done again that gained energy; null: none is calmer, or this
  // is that.
  const FloatControls* calmer_controls = nullptr;
  FloatSubstep substep{};  // the one under way
  // Null: the cloth passes through everything but colliders. Of several cloths: that of their
  // world.
  const ContactSurface* contact_surface = nullptr;
  const SurfaceParts* surface_parts = nullptr;  // null: particles alone touch colliders
  Vec4 world_origin{};                          // of the cloth's frame in that of its world [m]
  bool may_cross_itself = true;    // parts of the cloth may cross something when the step begins
  bool asks_for_impulses = false;  // StepReport::impulses
  bool asks_for_contacts = false;  // StepImpulses::contacts
  std::span<const Collider> colliders{};
  EdgesOfStep edges{};                    // if there are surface parts
  std::optional<EnergyBalance> energy{};  // StepItem::energy
  Interruption* interruption = nullptr;   // of stages that take long; null: nobody is asked

  // Whether collider k is a rigid body.
  bool IsBody(size_t k) const { return controls.has_bodies && colliders[k].is_body(); }
  // Null: nobody asks for them.
  ImpulseSums* impulses() const { return asks_for_impulses ? &scratch.impulses : nullptr; }

  // function(i, sums) of every held particle i, if anybody asks for impulses.
  template <class Function>
  void ForHeldAsked(const Function& function) const {
    if (impulses() == nullptr) return;
    for (const uint32_t i : held.particles) function(i, *impulses());
  }

  // Whether the strips solve a link more than once in a substep: then they need what they have
  // accumulated.
  bool SolvesLinksAgain() const { return max_iterations > 1 || model.has_ways_back(); }
  // Whether they or a report read it.
  bool KeepsImpulses() const { return SolvesLinksAgain() || substep.is_last; }

  // function(begin, end) of ranges that divide [0, count).
  template <class Function>
  void ForRanges(size_t count, size_t grain, const Function& function) const {
    team.AnyOf(0, count, grain, [&](size_t begin, size_t end, uint32_t) {
      function(begin, end);
      return false;
    });
  }
  // Whether function(particles) is true of any of the ranges that divide the free particles.
  template <class Function>
  bool AnyFreeRange(const Function& function) const {
    const std::span<const uint32_t> particles = held.free_particles;
    return team.AnyOf(0, particles.size(), kParticleGrain,
                      [&](size_t begin, size_t end, uint32_t) -> bool {
                        return function(particles.subspan(begin, end - begin));
                      });
  }
  template <class Function>
  void ForFreeRanges(const Function& function) const {
    AnyFreeRange([&](std::span<const uint32_t> particles) {
      function(particles);
      return false;
    });
  }
  // function(i) of every free particle i.
  template <class Function>
  void ForFreeParticles(const Function& function) const {
    ForFreeRanges([&](std::span<const uint32_t> particles) {
      const Function local = function;  // what it holds need not be read again for every particle
      for (const uint32_t i : particles) local(i);
    });
  }
};

}  // namespace drape::cpu

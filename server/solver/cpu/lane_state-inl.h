// What a step of a group of cloths works on. Compiled once per instruction set.
#if defined(DRAPE_CPU_LANE_STATE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef DRAPE_CPU_LANE_STATE_INL_H_
#undef DRAPE_CPU_LANE_STATE_INL_H_
#else
#define DRAPE_CPU_LANE_STATE_INL_H_
#endif

#include <algorithm>
#include <array>
#include <span>

#include "server/solver/cpu/cloth_lanes-inl.h"
#include "server/solver/cpu/lane_step.h"

HWY_BEFORE_NAMESPACE();
namespace drape::cpu::HWY_NAMESPACE {
namespace {

// One particle of each cloth. While a substep lasts p is b and u the mean velocity, else v.
struct ClothParticle {
  ClothVectors p, u;
};

// One collider of each cloth, all of one kind (FloatCollider).
struct ClothCollider {
  FloatCollider::Kind kind;
  ClothVectors point, vector;
  ClothLanes offset;
  std::array<ClothVectors, 3> axes;
};

// What that collider has done to one particle of each cloth in this substep, times w
// (ContactImpulses).
struct ClothContact {
  ClothVectors tangent;
  ClothLanes normal, floor, rebound;
};

// ParticleBox of each cloth.
struct ClothBox {
  ClothVectors low, high;
};
// Of those whose places are in their boxes; what is not a number is not.
HWY_INLINE ClothMask Holds(const ClothBox& box, const ClothVectors& place) {
  return ((place.x >= box.low.x) & (box.high.x >= place.x)) &
         ((place.y >= box.low.y) & (box.high.y >= place.y)) &
         ((place.z >= box.low.z) & (box.high.z >= place.z));
}

using PairLinkSolution = StripLinkSolution<PairLanes, PairVectors>;

// One number of each cloth; lanes without a cloth are like the last one.
template <class Number>
ClothLanes NumberOf(std::span<const LaneCloth> cloths, const Number& number) {
  alignas(64) float values[kClothCount];
  for (size_t lane = 0; lane < kClothCount; ++lane) {
    values[lane] = number(cloths[std::min(lane, cloths.size() - 1)].context.controls);
  }
  return LoadCloths(values);
}

template <class Vector>
ClothVectors VectorOf(std::span<const LaneCloth> cloths, const Vector& vector) {
  return {NumberOf(cloths, [&](const FloatControls& c) { return vector(c)[0]; }),
          NumberOf(cloths, [&](const FloatControls& c) { return vector(c)[1]; }),
          NumberOf(cloths, [&](const FloatControls& c) { return vector(c)[2]; })};
}

// Everything one step of a group needs.
struct LaneContext {
  LaneContext(std::span<const LaneCloth> cloths, LaneScratch& scratch)
      : model(cloths[0].context.model),
        controls(cloths[0].context.controls),
        max_iterations(cloths[0].context.max_iterations),
        particles(scratch.particles.Reserve<ClothParticle>(particle_count())),
        previous(scratch.previous.Reserve<ClothParticle>(
            controls.schedule.has_two_steps() ? particle_count() : 0)),
        pin_targets(scratch.pin_targets.Reserve<ClothVectors>(model.pins.size())),
        strip_links(scratch.strip_links.Reserve<PairLinkSolution>(model.longest_strip)),
        end_directions(scratch.end_directions.Reserve<PairVectors>(
            controls.has_start_directions() ? model.longest_strip : 0)),
        distance_impulses(scratch.distance_impulses.Reserve<ClothLanes>(impulse_count())),
        twists(
            scratch.twists.Reserve<ClothVectors>(2 * (model.source->grid_columns() + size_t{1}))),
        reach(scratch.reaches[0]),
        colliders(scratch.colliders.Reserve<ClothCollider>(collider_count())),
        accelerations(scratch.accelerations.Reserve<ClothVectors>(
            model.has_springs() ? model.particle_count : 0)),
        impulses(scratch.impulses.Reserve<ClothVectors>(kick_count())),
        predicted(scratch.predicted.Reserve<ClothVectors>(
            controls.schedule.has_two_steps() ? particle_count() : 0)),
        joint_impulses(scratch.joint_impulses.Reserve<ClothVectors>(model.joints.size())),
        refinement(scratch.refinement),
        contacts(scratch.contacts.Reserve<ClothContact>(model.particle_count * collider_count())),
        gravity(VectorOf(cloths, [](const FloatControls& c) { return c.gravity; })),
        wind(VectorOf(cloths, [](const FloatControls& c) { return c.wind; })),
        air_drag(NumberOf(cloths, [](const FloatControls& c) { return c.air_drag; })),
        air_lift(NumberOf(cloths, [](const FloatControls& c) { return c.air_lift; })),
        end_share(NumberOf(cloths, [](const FloatControls& c) { return c.end_share; })),
        friction_static(NumberOf(cloths, [](const FloatControls& c) { return c.friction_static; })),
        friction_dynamic(
            NumberOf(cloths, [](const FloatControls& c) { return c.friction_dynamic; })),
        restitution(NumberOf(cloths, [](const FloatControls& c) { return c.restitution; })),
        slowest_rebound(NumberOf(cloths, [](const FloatControls& c) { return c.slowest_rebound; })),
        has_restitution(IsAnyLaneSet(restitution > SplatCloths(0))) {}

  // Colliders that the step works on.
  size_t collider_count() const { return reach.near.size(); }
  // With the spare one.
  size_t particle_count() const { return model.particle_count + size_t{1}; }
  // Of elastic elements or triangles.
  size_t kick_count() const {
    return std::max(model.source->elastic_elements().size(),
                    controls.has_air_forces ? model.source->triangles().size() : size_t{0});
  }
  // Of constraints with an accumulated impulse, in the places of the model, and padding.
  size_t impulse_count() const {
    const bool has_impulses = model.has_compliance() || model.has_inequalities();
    return has_impulses ? (model.groups.size() + 1) * kLaneCount : 0;
  }

  const FloatModel& model;
  const FloatControls& controls;  // of the first cloth: only what a group shares may be used
  const uint32_t max_iterations;  // sweeps per substep at most
  // The working memory, LaneScratch.
  ClothParticle* const particles;
  ClothParticle* const previous;
  ClothVectors* const pin_targets;
  PairLinkSolution* const strip_links;
  PairVectors* const end_directions;
  ClothLanes* const distance_impulses;
  ClothVectors* const twists;
  const ColliderReach& reach;  // only what a group shares
  ClothCollider* const colliders;
  ClothVectors* const accelerations;
  ClothVectors* const impulses;
  ClothVectors* const predicted;
  ClothVectors* const joint_impulses;
  Refinement& refinement;
  ClothContact* const contacts;  // [particle_count][collider_count]
  // What differs between the cloths.
  const ClothVectors gravity;
  const ClothVectors wind;
  const ClothLanes air_drag, air_lift;
  const ClothLanes end_share;
  const ClothLanes friction_static, friction_dynamic;
  const ClothLanes restitution, slowest_rebound;
  const bool has_restitution;                            // some cloth has
  ClothLanes damping_factor = SplatCloths(1);            // of the substep under way
  bool has_damping = false;                              // some cloth has
  ClothBox range{};                                      // ColliderReach::range
  ClothMask is_held = SplatCloths(0) >= SplatCloths(0);  // of those that have not left it
  FloatSubstep substep{};                                // the one under way, but for the damping
  ClothMask is_running{};  // those whose sweeps go on; the others stay as they are
};

// The same vectors of each cloth, `vectors[lane]`: store(index, vector) of each in turn. Several
// are laid out before the first is read: a processor cannot hand several stores that it has not yet
// done to one longer load.
template <class Store>
void Interleave(const Lanes* const (&vectors)[kClothCount], size_t count, const Store& store) {
  constexpr size_t kTileCount = 8;
  alignas(64) Lanes tiles[kTileCount][kClothCount];
  for (size_t begin = 0; begin < count; begin += kTileCount) {
    const size_t tile_count = std::min(kTileCount, count - begin);
    for (size_t lane = 0; lane < kClothCount; ++lane) {
      for (size_t k = 0; k < tile_count; ++k) tiles[k][lane] = vectors[lane][begin + k];
    }
    for (size_t k = 0; k < tile_count; ++k) {
      ClothVectors result;
      ClothLanes unused;
      hn::LoadInterleaved4(LaneTag(), reinterpret_cast<const float*>(tiles[k]), result.x.v,
                           result.y.v, result.z.v, unused.v);
      store(begin + k, result);
    }
  }
}

void Separate(const ClothVectors& vectors, Lanes* const* results, size_t cloth_count,
              size_t index) {
  alignas(64) Lanes tile[kClothCount];
  hn::StoreInterleaved4(vectors.x.v, vectors.y.v, vectors.z.v, hn::Zero(LaneTag()), LaneTag(),
                        reinterpret_cast<float*>(tile));
  for (size_t lane = 0; lane < cloth_count; ++lane) results[lane][index] = tile[lane];
}

void GatherColliders(std::span<const LaneCloth> cloths, const LaneContext& context) {
  ClothCollider* next = context.colliders;
  for (const uint32_t k : context.reach.near) {
    const auto of = [&](const auto& part) {
      return VectorOf(cloths, [&](const FloatControls& c) { return part(c.colliders[k]); });
    };
    ClothCollider& collider = *next++;
    collider.kind = context.controls.colliders[k].kind;
    collider.point = of([](const FloatCollider& c) { return c.point; });
    collider.vector = of([](const FloatCollider& c) { return c.vector; });
    collider.offset =
        NumberOf(cloths, [&](const FloatControls& c) { return c.colliders[k].offset; });
    for (size_t axis = 0; axis < 3; ++axis) {
      collider.axes[axis] = of([&](const FloatCollider& c) { return c.axes[axis]; });
    }
  }
}

void GatherRanges(std::span<const ColliderReach> reaches, LaneContext& context) {
  Lanes low[kClothCount], high[kClothCount];
  const Lanes *lows[kClothCount], *highs[kClothCount];
  for (size_t lane = 0; lane < kClothCount; ++lane) {
    const ParticleBox& range = reaches[std::min(lane, reaches.size() - 1)].range;
    low[lane] = range.low;
    high[lane] = range.high;
    lows[lane] = low + lane;
    highs[lane] = high + lane;
  }
  Interleave(lows, 1, [&](size_t, const ClothVectors& v) { context.range.low = v; });
  Interleave(highs, 1, [&](size_t, const ClothVectors& v) { context.range.high = v; });
}

// States and pin targets into the lanes; lanes without a cloth are like the last one.
void Gather(std::span<const LaneCloth> cloths, const LaneContext& context) {
  const Lanes* positions[kClothCount];
  const Lanes* velocities[kClothCount];
  const Lanes* targets[kClothCount];
  for (size_t lane = 0; lane < kClothCount; ++lane) {
    const LaneCloth& cloth = cloths[std::min(lane, cloths.size() - 1)];
    positions[lane] = cloth.state.positions.data();
    velocities[lane] = cloth.state.velocities.data();
    targets[lane] = cloth.context.pin_targets.data();
  }
  Interleave(positions, context.particle_count(),
             [&](size_t i, const ClothVectors& p) { context.particles[i].p = p; });
  Interleave(velocities, context.particle_count(),
             [&](size_t i, const ClothVectors& v) { context.particles[i].u = v; });
  Interleave(targets, context.model.pins.size(),
             [&](size_t k, const ClothVectors& target) { context.pin_targets[k] = target; });
}

// The lanes into one state per cloth.
void Scatter(const LaneContext& context, std::span<FloatState> results) {
  Lanes* positions[kClothCount] = {};
  Lanes* velocities[kClothCount] = {};
  for (size_t lane = 0; lane < results.size(); ++lane) {
    results[lane].positions.resize(context.particle_count());
    results[lane].velocities.resize(context.particle_count());
    positions[lane] = results[lane].positions.data();
    velocities[lane] = results[lane].velocities.data();
  }
  for (size_t i = 0; i < context.particle_count(); ++i) {
    Separate(context.particles[i].p, positions, results.size(), i);
    Separate(context.particles[i].u, velocities, results.size(), i);
  }
}

// Whether each cloth has left its range.
void ScatterReaches(const LaneContext& context, std::span<ColliderReach> reaches) {
  alignas(64) float is_held[kClothCount];
  hn::Store(Select(context.is_held, SplatCloths(1), SplatCloths(0)).v, LaneTag(), is_held);
  for (size_t lane = 0; lane < reaches.size(); ++lane) reaches[lane].has_left = is_held[lane] == 0;
}

// What Measure reads of the working memory of a cloth.
void ScatterImpulses(const LaneContext& context, size_t lane, StepScratch& scratch) {
  scratch.contacts.resize(context.model.particle_count * context.collider_count());
  for (const uint32_t i : context.model.free_particles) {
    for (size_t k = 0; k < context.collider_count(); ++k) {
      const size_t place = i * context.collider_count() + k;
      scratch.contacts[place].floor = hn::ExtractLane(context.contacts[place].floor.v, lane);
    }
  }
  scratch.joint_impulses.resize(context.model.joints.size());
  for (size_t k = 0; k < context.model.joints.size(); ++k) {
    const ClothVectors& impulse = context.joint_impulses[k];
    scratch.joint_impulses[k] =
        Lanes{hn::ExtractLane(impulse.x.v, lane), hn::ExtractLane(impulse.y.v, lane),
              hn::ExtractLane(impulse.z.v, lane), 0};
  }
  scratch.distance_impulses.resize(context.impulse_count() / kLaneCount);
  for (size_t place = 0; place < context.impulse_count(); ++place) {
    scratch.distance_impulses[place / kLaneCount][place % kLaneCount] =
        hn::ExtractLane(context.distance_impulses[place].v, lane);
  }
}

}  // namespace
}  // namespace drape::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // include guard, once per instruction set

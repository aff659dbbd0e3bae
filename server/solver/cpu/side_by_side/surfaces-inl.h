// The colliders of a group, resting or moving. Compiled once per instruction set.
#if defined(DRAPE_CPU_SIDE_BY_SIDE_SURFACES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef DRAPE_CPU_SIDE_BY_SIDE_SURFACES_INL_H_
#undef DRAPE_CPU_SIDE_BY_SIDE_SURFACES_INL_H_
#else
#define DRAPE_CPU_SIDE_BY_SIDE_SURFACES_INL_H_
#endif

#include <algorithm>
#include <functional>
#include <span>
#include <vector>

#include "server/solver/cpu/formulas/constraint_math-inl.h"
#include "server/solver/cpu/formulas/contact_math-inl.h"
#include "server/solver/cpu/side_by_side/exchange-inl.h"
#include "server/solver/cpu/side_by_side/state-inl.h"

HWY_BEFORE_NAMESPACE();
namespace drape::cpu::HWY_NAMESPACE {
namespace {

// The near colliders of a group, of one type or the other.
class RestingList {
 public:
  explicit RestingList(const GroupContext& context)
      : colliders_(context.colliders), size_(context.collider_count()) {}
  size_t size() const { return size_; }
  RestingSurfaces operator[](size_t k) const { return RestingSurfaces(colliders_[k]); }

 private:
  const ClothCollider* const colliders_;
  const size_t size_;
};
class MovingList {
 public:
  explicit MovingList(const GroupContext& context)
      : colliders_(context.colliders), motions_(context.motions), size_(context.collider_count()) {}
  size_t size() const { return size_; }
  MovingSurfaces operator[](size_t k) const { return {colliders_[k], motions_[k]}; }

 private:
  const ClothCollider* const colliders_;
  const ClothMotion* const motions_;
  const size_t size_;
};

// function(surfaces)
template <class Function>
auto WithSurfaces(const GroupContext& context, const Function& function) {
  if (context.motions == nullptr) return function(RestingList(context));
  return function(MovingList(context));
}

// One collider of each cloth.
using SurfacesOfCloths = std::span<const MovingSurface>;

// The vector that `vector(surface)` refers to, of each cloth.
template <class Vector>
HWY_INLINE VectorsCloths VectorOf(SurfacesOfCloths surfaces, const Vector& vector) {
  const Vec4* places[kClothCount];
  for (size_t lane = 0; lane < kClothCount; ++lane) {
    places[lane] = &std::invoke(vector, surfaces[std::min(lane, surfaces.size() - 1)]);
  }
  return LoadVectors(places, 0);
}

template <class Number>
VecCloths NumberOf(SurfacesOfCloths surfaces, const Number& number) {
  alignas(64) float values[kClothCount];
  for (size_t lane = 0; lane < kClothCount; ++lane) {
    values[lane] = std::invoke(number, surfaces[std::min(lane, surfaces.size() - 1)]);
  }
  return LoadCloths(values);
}

template <class Pose>
ClothPose PoseOf(SurfacesOfCloths surfaces, const Pose& pose) {
  const auto vector = [&](const auto& part) {
    return VectorOf(surfaces, [&](const MovingSurface& surface) -> const Vec4& {
      return part(std::invoke(pose, surface));
    });
  };
  const auto column = [&](size_t k) {
    return vector([k](const MovingSurface::Pose& p) -> const Vec4& { return p.columns[k]; });
  };
  return {vector([](const MovingSurface::Pose& p) -> const Vec4& { return p.position; }),
          {column(0), column(1), column(2)}};
}

ClothMotion MotionOf(SurfacesOfCloths surfaces, float duration) {
  return {.pivot = VectorOf(surfaces, &MovingSurface::pivot),
          .start = PoseOf(surfaces, &MovingSurface::start),
          .end = PoseOf(surfaces, &MovingSurface::end),
          .velocity = VectorOf(surfaces, &MovingSurface::velocity),
          .angular_velocity = VectorOf(surfaces, &MovingSurface::angular_velocity),
          .chord_sine = NumberOf(surfaces, &MovingSurface::chord_sine),
          .chord_cosine = NumberOf(surfaces, &MovingSurface::chord_cosine),
          .duration = SplatCloths(duration)};
}

// The colliders are where they are in a substep of this index. `surfaces`: those of each cloth,
// collider after collider.
void PlaceColliders(std::span<const GroupCloth> cloths, const GroupContext& context, uint32_t index,
                    double substep_s, std::vector<MovingSurface>& surfaces) {
  if (context.motions == nullptr) return;
  if (index == 0) surfaces.clear();
  for (size_t k = 0; k < context.collider_count(); ++k) {
    ClothMotion& motion = context.motions[k];
    const uint32_t near = context.reach.near[k];
    for (size_t lane = 0; lane < cloths.size(); ++lane) {
      if (index > 0) {
        surfaces[k * cloths.size() + lane].Advance();
        continue;
      }
      const StepContext& cloth = cloths[lane].context;
      surfaces.emplace_back(cloth.controls.colliders[near], cloth.collider_motions[near],
                            substep_s);
    }
    const SurfacesOfCloths of_cloths = std::span(surfaces).subspan(k * cloths.size());
    if (index == 0) {
      motion = MotionOf(of_cloths.first(cloths.size()), static_cast<float>(substep_s));
    } else {
      motion.start = motion.end;
      motion.end = PoseOf(of_cloths.first(cloths.size()), &MovingSurface::end);
    }
    motion.size =
        (SumOfSizes(motion.end.position) + SumOfSizes(motion.pivot)) + context.colliders[k].size;
  }
}

}  // namespace
}  // namespace drape::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // include guard, once per instruction set

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

// What of the place a collider of this kind needs; the rest stays as it is.
template <class Pose>
void LoadPose(SurfacesOfCloths surfaces, const Pose& pose, ShapeKind kind, ClothPose& loaded) {
  const auto vector = [&](const auto& part) {
    return VectorOf(surfaces, [&](const MovingSurface& surface) -> const Vec4& {
      return part(std::invoke(pose, surface));
    });
  };
  loaded.position = vector([](const MovingSurface::Pose& p) -> const Vec4& { return p.position; });
  loaded.place.point =
      vector([](const MovingSurface::Pose& p) -> const Vec4& { return p.place.point; });
  loaded.place.vector =
      vector([](const MovingSurface::Pose& p) -> const Vec4& { return p.place.vector; });
  if (kind == ShapeKind::kSphere || kind == ShapeKind::kPlane) return;
  for (size_t k = 0; k < 3; ++k) {
    loaded.place.axes[k] =
        vector([k](const MovingSurface::Pose& p) -> const Vec4& { return p.place.axes[k]; });
  }
}

// What is the same in all substeps.
void LoadVelocities(SurfacesOfCloths surfaces, float duration, ClothMotion& motion) {
  motion.velocity = VectorOf(surfaces, &MovingSurface::velocity);
  motion.angular_velocity = VectorOf(surfaces, &MovingSurface::angular_velocity);
  motion.chord_sine = NumberOf(surfaces, &MovingSurface::chord_sine);
  motion.chord_cosine = NumberOf(surfaces, &MovingSurface::chord_cosine);
  motion.duration = SplatCloths(duration);
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
    const ShapeKind kind = context.colliders[k].kind;
    const SurfacesOfCloths of_cloths =
        std::span(surfaces).subspan(k * cloths.size(), cloths.size());
    if (index == 0) {
      LoadVelocities(of_cloths, static_cast<float>(substep_s), motion);
      LoadPose(of_cloths, &MovingSurface::start, kind, motion.start);
    } else {
      motion.start = motion.end;
    }
    LoadPose(of_cloths, &MovingSurface::end, kind, motion.end);
    motion.size = SumOfSizes(motion.end.position) + SumOfSizes(motion.end.place.point);
  }
}

}  // namespace
}  // namespace drape::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // include guard, once per instruction set

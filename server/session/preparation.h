// What takes long in a first creation, or change, of cloths of some kind is done before the device
// thread begins with them.
#pragma once

#include <cstddef>
#include <memory>
#include <set>
#include <span>
#include <tuple>
#include <utility>

#include "server/session/cloth_record.h"
#include "server/solver/backend.h"

namespace drape {

// Cloths of one kind share all that they have of make_shared_parts: the model, what of it touches
// itself or others of its world, and what touches colliders.
using PartsKind = std::tuple<const SceneModel*, bool, bool, bool>;
PartsKind KindOf(const SceneModel& model, const ClothParameters& parameters);

// Not on the device thread. Once it is gone, nobody may have what it holds.
class Preparation {
 public:
  // For so many cloths, whatever they are like, the backend is asked (BackendDescription::prepare
  // and make_shared_parts); for more only where they share less with those before: cloths of one
  // request are mostly of one kind.
  static constexpr size_t kMaxOfOneKind = 16;

  // `interruption`: asked now and then; null: nobody is.
  explicit Preparation(const BackendDescription& backend, Interruption* interruption = nullptr)
      : backend_(backend), interruption_(interruption) {}

  // Of a cloth with these parameters as described.
  void Add(const std::shared_ptr<const SceneModel>& model, const ClothParameters& parameters,
           const Placement& placement);
  // To be held until the cloths are there.
  SharedParts Take() { return std::move(made_); }

 private:
  const BackendDescription& backend_;
  Interruption* const interruption_;
  size_t added_ = 0;
  std::set<PartsKind> kinds_;
  SharedParts made_;
};

// Whether a change that needs no other model may need other shared parts than the cloths have: what
// touches itself, or colliders with its edges. Of many cloths it is not worth to look.
bool MayNeedParts(std::span<const std::shared_ptr<ClothRecord>> cloths, const ClothChange& change);

}  // namespace drape

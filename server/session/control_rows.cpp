#include "server/session/control_rows.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "server/scene/constraint_places.h"
#include "server/scene/description_checks.h"
#include "server/session/start_cost.h"

namespace drape {
namespace {

// Limit on the wrong rows of a table that an error names.
constexpr size_t kMaxNamedRows = 16;

// Limit on the particles that the grips of one request search for the nearest: about 0.1 s.
constexpr uint64_t kMaxSearchedParticles = uint64_t{1} << 26;

// Limit on the constraints of the cloths whose rest lengths one request drives, each once: that of
// a single cloth, and about 0.5 s when all of them are driven for the first time.
constexpr uint64_t kMaxDrivenConstraints = uint64_t{1} << 23;

using ClothSpan = std::span<const std::shared_ptr<ClothRecord>>;
using ClothIndices = std::unordered_map<ClothId, uint32_t>;

// The cloths of a request, as its controls find them.
struct RequestCloths {
  ClothSpan records;
  std::span<const std::shared_ptr<const ClothDescription>> becoming;
  ClothIndices indices;

  std::shared_ptr<const ClothDescription> DescriptionOf(uint32_t index) const {
    return becoming.empty() || !becoming[index] ? records[index]->description() : becoming[index];
  }
};

// An error in a row: the column and the reason.
struct RowError {
  const char* column;
  std::string why;
};
using RowCheck = std::optional<RowError>;

// `check` brings a row's control into the frame of its cloth, or says what is wrong with it.
template <class Control, class Check>
Result<std::vector<ClothControl<Control>>> ResolveRows(const char* table,
                                                       const std::vector<ControlRow<Control>>& rows,
                                                       const RequestCloths& cloths, Check check) {
  std::vector<ClothControl<Control>> controls;
  std::vector<FieldViolation> violations;
  for (size_t r = 0; r < rows.size() && violations.size() < kMaxNamedRows; ++r) {
    const auto index = cloths.indices.find(rows[r].cloth);
    ClothControl<Control> control{0, rows[r].control};
    RowCheck error;
    if (index == cloths.indices.end()) {
      error = {"cloth_ids", "no cloth of this request"};
    } else {
      control.cloth_index = index->second;
      const auto description = cloths.DescriptionOf(index->second);
      error = check(*cloths.records[index->second], *description, control);
    }
    if (error.has_value()) {
      violations.push_back(
          {fmt::format("{}.{}[{}]", table, error->column, r), std::move(error->why)});
    } else {
      controls.push_back(std::move(control));
    }
  }
  if (!violations.empty()) return Status::InvalidFields(std::move(violations));
  return controls;
}

RowCheck CheckPin(const ClothRecord& cloth, const ClothDescription& description,
                  ClothControl<PinControl>& row) {
  PinControl& control = row.control;
  const SceneModel& model = *description.model;
  const auto pins = model.pins();
  const uint32_t named = control.particle;
  const bool exists = named < model.described_particle_count();
  if (exists) control.particle = model.ParticleOf(named);
  if (!exists || !std::binary_search(pins.begin(), pins.end(), control.particle)) {
    return RowError{"particles", fmt::format("particle {} is not pinned", named)};
  }
  control.target_m = cloth.placement.ClothFromEnvironment(control.target_m);
  return std::nullopt;
}

// The first collider that moves makes the device take the whole cloth anew, and every control shows
// all colliders of its cloth again, while everybody waits.
class ColliderCheck {
 public:
  RowCheck operator()(const ClothRecord& cloth, const ClothDescription& description,
                      ClothControl<ColliderControl>& row) {
    if (RowCheck error = CheckCollider(cloth, description, row)) return error;
    if (!moved_.insert(row.cloth_index).second) return std::nullopt;
    cost_ += description.model->particle_count() +
             RewritingCost(description, cloth.held_lengths.count());
    if (cost_ <= kMaxMovedCost) return std::nullopt;
    return RowError{
        "cloth_ids",
        fmt::format(
            "the cloths up to this row cost {}, at most {} are moved by one request (512 "
            "for each cloth, 1 for each of its particles, 128 for each collider, 2 for each "
            "driven rest length): send fewer rows per request",
            cost_, kMaxMovedCost)};
  }

 private:
  static RowCheck CheckCollider(const ClothRecord& cloth, const ClothDescription& description,
                                ClothControl<ColliderControl>& row);

  std::unordered_set<uint32_t> moved_;
  uint64_t cost_ = 0;
};

RowCheck ColliderCheck::CheckCollider(const ClothRecord& cloth, const ClothDescription& description,
                                      ClothControl<ColliderControl>& row) {
  ColliderControl& control = row.control;
  const std::vector<Collider>& colliders = description.parameters.colliders;
  if (control.collider >= colliders.size()) {
    return RowError{"colliders", fmt::format("{} is not below the number of colliders, {}",
                                             control.collider, colliders.size())};
  }
  if (colliders[control.collider].is_body()) {
    return RowError{"colliders",
                    fmt::format("collider {} has a mass: only forces move it", control.collider)};
  }
  control.target.position_m = cloth.placement.ClothFromEnvironment(control.target.position_m);
  return std::nullopt;
}

// The device searches particles while everybody waits.
class GripCheck {
 public:
  RowCheck operator()(const ClothRecord& cloth, const ClothDescription& description,
                      ClothControl<GripControl>& row) {
    GripControl& control = row.control;
    const uint32_t count = description.parameters.max_grips;
    if (control.slot >= count) {
      return RowError{
          "slots", fmt::format("{} is not below max_grips of the cloth, {}", control.slot, count)};
    }
    control.place_m = cloth.placement.ClothFromEnvironment(control.place_m);
    const SceneModel& model = *description.model;
    if (control.action == GripAction::kGrabNearest) {
      searched_ += model.particle_count();
      if (searched_ <= kMaxSearchedParticles) return std::nullopt;
      return RowError{"actions", fmt::format("the rows up to this one search {} particles, at most "
                                             "{} are allowed in one request",
                                             searched_, kMaxSearchedParticles)};
    }
    if (control.action != GripAction::kGrabParticle) return std::nullopt;
    const uint32_t named = control.particle;
    if (named >= model.described_particle_count()) {
      return RowError{"particles", fmt::format("{} is not below the number of particles, {}", named,
                                               model.described_particle_count())};
    }
    control.particle = model.ParticleOf(named);
    if (model.inverse_masses_per_kg()[control.particle] != 0) return std::nullopt;
    return RowError{"particles", fmt::format("particle {} is pinned", named)};
  }

 private:
  uint64_t searched_ = 0;
};

// The device begins to drive all lengths of a cloth with the first one, while everybody waits.
class DrivenCount {
 public:
  // Null: one more cloth may be driven.
  RowCheck Add(uint32_t cloth_index, const SceneModel& model) {
    if (!cloths_.insert(cloth_index).second) return std::nullopt;
    constraints_ += model.described_constraint_count();
    if (constraints_ <= kMaxDrivenConstraints) return std::nullopt;
    return RowError{"cloth_ids",
                    fmt::format("the cloths up to this row have {} constraints, at most {} are "
                                "driven by one request: send fewer rows per request",
                                constraints_, kMaxDrivenConstraints)};
  }

 private:
  std::unordered_set<uint32_t> cloths_;
  uint64_t constraints_ = 0;
};

// Keeps the ConstraintPlaces of each model, which take a pass over it.
class LengthCheck {
 public:
  explicit LengthCheck(DrivenCount& driven) : driven_(driven) {}

  RowCheck operator()(const ClothRecord& /*cloth*/, const ClothDescription& description,
                      const ClothControl<LengthControl>& row) {
    const uint32_t constraint = row.control.constraint;
    const auto& model = description.model;
    if (constraint >= model->described_constraint_count()) {
      return RowError{"constraints",
                      fmt::format("{} is not below the number of distance constraints, {}",
                                  constraint, model->described_constraint_count())};
    }
    const ConstraintPlaces& places = places_.try_emplace(model, *model).first->second;
    if (places.Find(constraint).has_value()) return driven_.Add(row.cloth_index, *model);
    return RowError{"constraints", fmt::format("constraint {} joins two pins", constraint)};
  }

 private:
  DrivenCount& driven_;
  // Cloths mostly share a model. It is held, so that no other gets its address.
  std::unordered_map<std::shared_ptr<const SceneModel>, ConstraintPlaces> places_;
};

// A row costs a pass over its cloth, so each cloth may have one.
class ScaleCheck {
 public:
  explicit ScaleCheck(DrivenCount& driven) : driven_(driven) {}

  RowCheck operator()(const ClothRecord& cloth, const ClothDescription& description,
                      const ClothControl<LengthScale>& row) {
    if (!scaled_.insert(row.cloth_index).second) {
      return RowError{"cloth_ids", fmt::format("{} occurs twice", cloth.id.Packed())};
    }
    const auto& model = description.model;
    if (model->constraint_count() == 0) {
      return RowError{"scales", "the cloth has no distance constraint"};
    }
    if (RowCheck error = driven_.Add(row.cloth_index, *model)) return error;
    const auto [shortest, longest] = std::minmax_element(
        model->constraints().begin(), model->constraints().end(),
        [](const auto& a, const auto& b) { return a.rest_length_m < b.rest_length_m; });
    const double shortest_m = row.control.scale * shortest->rest_length_m;
    const double longest_m = row.control.scale * longest->rest_length_m;
    if (shortest_m >= kMinRestLength_m && longest_m <= kMaxExtent_m) return std::nullopt;
    return RowError{
        "scales",
        fmt::format("{} makes rest lengths of {} to {} m, which are not in [{}, {}] m",
                    row.control.scale, shortest_m, longest_m, kMinRestLength_m, kMaxExtent_m)};
  }

 private:
  DrivenCount& driven_;
  std::unordered_set<uint32_t> scaled_;
};

}  // namespace

Result<StepControls> ResolveControls(
    const ControlRows& rows, ClothSpan records,
    std::span<const std::shared_ptr<const ClothDescription>> becoming) {
  StepControls controls;
  const bool is_any_given = !rows.pins.empty() || !rows.colliders.empty() ||
                            !rows.lengths.empty() || !rows.length_scales.empty() ||
                            !rows.grips.empty();
  if (!is_any_given) return controls;
  RequestCloths cloths{records, becoming, {}};
  for (uint32_t k = 0; k < records.size(); ++k) cloths.indices.emplace(records[k]->id, k);
  DRAPE_ASSIGN_OR_RETURN(controls.pins, ResolveRows("pin_controls", rows.pins, cloths, CheckPin));
  DRAPE_ASSIGN_OR_RETURN(controls.colliders,
                         ResolveRows("collider_controls", rows.colliders, cloths, ColliderCheck()));
  DrivenCount driven;
  DRAPE_ASSIGN_OR_RETURN(controls.lengths, ResolveRows("rest_length_controls", rows.lengths, cloths,
                                                       LengthCheck(driven)));
  DRAPE_ASSIGN_OR_RETURN(
      controls.length_scales,
      ResolveRows("rest_length_scales", rows.length_scales, cloths, ScaleCheck(driven)));
  DRAPE_ASSIGN_OR_RETURN(controls.grips,
                         ResolveRows("grip_controls", rows.grips, cloths, GripCheck()));
  return controls;
}

}  // namespace drape

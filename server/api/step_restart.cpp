#include "server/api/step_restart.h"

#include <string>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "server/session/cloth_reset.h"
#include "server/session/start_cost.h"

namespace drape::api {
namespace {

// Most particles that a step starts again: it keeps the device for about 0.2 s.
constexpr uint64_t kMaxRestartedParticles = uint64_t{1} << 24;

// Fields of a part of the request.
Status InPart(const std::string& path, const Status& status) {
  std::vector<FieldViolation> violations = status.violations();
  if (violations.empty()) return status;
  for (FieldViolation& violation : violations) violation.field = path + violation.field;
  return Status::InvalidFields(std::move(violations));
}

Status CheckParticles(const ClothList& resets, const std::vector<LoadPair>& loads) {
  uint64_t particles = 0;
  for (const auto& cloth : resets) particles += cloth->description()->model->particle_count();
  for (const LoadPair& pair : loads) particles += pair.from->description->model->particle_count();
  if (particles <= kMaxRestartedParticles) return Status::Ok();
  const bool are_loads = resets.empty();
  return Status::InvalidField(are_loads ? "loads.cloth_ids" : "resets.cloth_ids",
                              "have " + std::to_string(particles) + " particles, at most " +
                                  std::to_string(kMaxRestartedParticles) +
                                  " start again within a step: use " +
                                  (are_loads ? "LoadStates" : "ResetCloths"));
}

// What is done beside the particles, for small cloths that have much else.
Status CheckCosts(const ClothList& resets, const ClothStarts& starts,
                  const std::vector<LoadPair>& loads) {
  uint64_t cost = 0;
  for (const auto& cloth : resets) {
    const auto description = cloth->description();
    cost += starts.overrides.empty() ? PlacingCost(*description)
                                     : RewritingCost(*description, cloth->held_lengths.count());
  }
  for (const LoadPair& pair : loads) {
    const auto& lengths = pair.from->runtime.lengths;
    cost += RewritingCost(*pair.from->description, static_cast<uint32_t>(lengths.track().size()));
  }
  if (cost <= kMaxRestartCost) return Status::Ok();
  const bool are_loads = resets.empty();
  return Status::InvalidField(
      are_loads ? "loads.cloth_ids" : "resets.cloth_ids",
      "cost " + std::to_string(cost) + ", at most " + std::to_string(kMaxRestartCost) +
          " start again within a step (32 for each collider; with an override or a load 512 for "
          "each cloth, 128 for each collider, 2 for each driven rest length): name fewer cloths "
          "per request, or use " +
          (are_loads ? "LoadStates" : "ResetCloths"));
}

// Whose reset and load would both be done.
Status CheckApart(const std::vector<ClothId>& resets, const std::vector<ClothId>& loads) {
  const std::unordered_set<ClothId> ids(resets.begin(), resets.end());
  for (size_t r = 0; r < loads.size(); ++r) {
    if (!ids.contains(loads[r])) continue;
    return Status::InvalidField("loads.cloth_ids[" + std::to_string(r) + "]",
                                std::to_string(loads[r].Packed()) + " is in resets, too");
  }
  return Status::Ok();
}

Result<StateLoads> FindLoads(const CheckedLoads& loads, const Session& session,
                             const ClothList& cloths) {
  if (loads.cloths.empty()) return StateLoads();
  DRAPE_RETURN_IF_ERROR(FindAmong(loads.cloths, cloths, "loads").status());
  Result<StateLoads> found = session.FindLoads(loads.name, loads.cloths, loads.saved);
  if (!found.ok()) return InPart("loads.", found.status());
  return found;
}

}  // namespace

Result<Descriptions> AddRestarts(const CheckedStep& checked, const Session& session,
                                 const ClothList& cloths, StepWork& work) {
  Descriptions becoming;
  if (checked.resets.cloths.empty() && checked.loads.cloths.empty()) return becoming;
  DRAPE_ASSIGN_OR_RETURN(ClothList resets, FindAmong(checked.resets.cloths, cloths, "resets"));
  DRAPE_RETURN_IF_ERROR(CheckApart(checked.resets.cloths, checked.loads.cloths));
  DRAPE_ASSIGN_OR_RETURN(StateLoads loads, FindLoads(checked.loads, session, cloths));
  DRAPE_RETURN_IF_ERROR(CheckParticles(resets, loads.pairs));
  DRAPE_RETURN_IF_ERROR(CheckCosts(resets, checked.resets.starts, loads.pairs));
  DRAPE_RETURN_IF_ERROR(session.ChargeLoads(loads.pairs));

  std::unordered_map<const ClothRecord*, const SavedCloth*> sources;  // null: a reset
  for (const auto& cloth : resets) sources.emplace(cloth.get(), nullptr);
  for (const LoadPair& pair : loads.pairs) sources.emplace(pair.into.get(), pair.from);
  becoming.resize(cloths.size());
  work.restarts.resize(cloths.size());
  for (size_t k = 0; k < cloths.size(); ++k) {
    const auto source = sources.find(cloths[k].get());
    if (source == sources.end()) continue;
    RestartPoint& restart = work.restarts[k].emplace();
    if (source->second == nullptr) continue;
    const ClothProgress& progress = source->second->runtime.progress;
    restart = {progress.completed_steps, progress.fault != FaultReason::kNone, true};
    becoming[k] = source->second->description;
  }
  work.restart = [resets = std::move(resets), starts = checked.resets.starts,
                  loads = std::move(loads)](Backend& backend) -> Status {
    // So that none is done where one is refused: then only the room of the device is in question.
    DRAPE_RETURN_IF_ERROR(InPart("loads.", CheckLoadsNow(loads.pairs)));
    DRAPE_RETURN_IF_ERROR(InPart("resets.", ResetOnDevice(backend, resets, starts)));
    return LoadOnDevice(backend, loads.pairs);
  };
  return becoming;
}

}  // namespace drape::api

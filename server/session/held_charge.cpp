#include "server/session/held_charge.h"

#include <algorithm>
#include <unordered_map>
#include <utility>

#include "server/session/cloth_record.h"

namespace drape {

Status HoldAll(std::span<const CountedCloth> cloths, HeldCharge ClothRecord::*held,
               const std::function<Result<std::shared_ptr<const void>>(uint32_t count)>& charge) {
  struct Wanted {
    uint32_t count;
    std::shared_ptr<const void> charge{};
  };
  std::unordered_map<ClothRecord*, Wanted> wanted;
  for (const auto& [cloth, count] : cloths) {
    if (count <= (*cloth.*held).count()) continue;
    uint32_t& most = wanted.try_emplace(cloth.get(), Wanted{count}).first->second.count;
    most = std::max(most, count);
  }
  for (auto& [cloth, its] : wanted) {
    DRAPE_ASSIGN_OR_RETURN(its.charge, charge(its.count));
  }
  for (auto& [cloth, its] : wanted) (cloth->*held).Hold(its.count, std::move(its.charge));
  return Status::Ok();
}

}  // namespace drape

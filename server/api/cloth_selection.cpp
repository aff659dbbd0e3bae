#include "server/api/cloth_selection.h"

#include <string>

namespace drape::api {

Status CheckNamesCloths(const ClothIdList& cloth_ids) {
  if (!cloth_ids.empty()) return Status::Ok();
  return Status::InvalidField("cloth_ids", "is empty: at least 1 id is needed");
}

std::vector<ClothId> ToClothIds(const ClothIdList& cloth_ids) {
  std::vector<ClothId> ids;
  ids.reserve(cloth_ids.size());
  for (const uint64_t id : cloth_ids) ids.push_back(ClothId::FromPacked(id));
  return ids;
}

std::vector<ClothId> CheckSelection(const ClothIdList& cloth_ids, bool all_cloths,
                                    const FieldPath& path, Violations& violations) {
  violations.Require(!cloth_ids.empty() || all_cloths, path.Child("cloth_ids"), [] {
    return std::string("is empty: name at least 1 cloth, or set all_cloths to mean every one");
  });
  violations.Require(cloth_ids.empty() || !all_cloths, path.Child("all_cloths"), [&] {
    return "is set beside " + std::to_string(cloth_ids.size()) + " cloth_ids: only one of the two";
  });
  return ToClothIds(cloth_ids);
}

}  // namespace drape::api

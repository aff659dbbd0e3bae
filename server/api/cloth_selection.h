// The cloths that a request means: those that it names, or, if it says so, every cloth of the
// session. Pure.
#pragma once

#include <vector>

#include "drape/v1/cloths.pb.h"
#include "server/api/field_checks.h"
#include "server/core/ids.h"
#include "server/core/status.h"

namespace drape::api {

using ClothIdList = google::protobuf::RepeatedField<uint64_t>;

// At least one id, for requests that cannot mean all of them.
Status CheckNamesCloths(const ClothIdList& cloth_ids);
std::vector<ClothId> ToClothIds(const ClothIdList& cloth_ids);

// The named ids; empty: every cloth (all_cloths). Neither is a violation, because a selection that
// happens to be empty must not act on everything; so are both together. `path` leads to the message
// that has the two fields.
std::vector<ClothId> CheckSelection(const ClothIdList& cloth_ids, bool all_cloths,
                                    const FieldPath& path, Violations& violations);

template <class Request>
std::vector<ClothId> CheckSelection(const Request& request, const FieldPath& path,
                                    Violations& violations) {
  return CheckSelection(request.cloth_ids(), request.all_cloths(), path, violations);
}

// The same of a request that has no other violations.
template <class Request>
Result<std::vector<ClothId>> CheckSelection(const Request& request) {
  Violations violations;
  std::vector<ClothId> ids = CheckSelection(request, FieldPath(), violations);
  DRAPE_RETURN_IF_ERROR(violations.ToStatus());
  return ids;
}

}  // namespace drape::api

// From a StateView to what an answer brings of the states, or INVALID_ARGUMENT. Pure.
#pragma once

#include "drape/v1/state.pb.h"
#include "server/api/field_checks.h"
#include "server/api/state_reductions.h"
#include "server/core/status.h"
#include "server/scheduler/step_work.h"
#include "server/session/session.h"

namespace drape::api {

// Longest list of particles, because waiting requests keep it in memory. A client that wants more
// reads all particles.
inline constexpr int kMaxViewParticles = 4096;
// Most particles of a request with reductions: they take about 0.1 s of the thread that makes all
// answers.
inline constexpr uint64_t kMaxReducedParticles = uint64_t{1} << 22;

// What an answer brings of the states.
struct ViewSpec {
  StateFields fields;  // the columns that are sent
  v1::StateView::Encoding encoding = v1::StateView::ENCODING_UNSPECIFIED;
  ReductionSpec reductions{};

  bool any() const { return fields.any() || reductions.any(); }
  // The columns to be read for it: reductions take the positions of all particles.
  StateFields FieldsRead() const;
};

// `path` leads to the view. Without a field, positions are meant. Particles that are not strictly
// ascending, or more than kMaxViewParticles, and parts of reductions that do not belong together,
// are violations.
ViewSpec CheckView(const FieldPath& path, const v1::StateView& view, Violations& violations);

// INVALID_ARGUMENT that names the particles which one of the cloths does not have, or says that the
// target is of another number of particles, or that the cloths are too large for reductions. `view`
// comes from CheckView.
Status CheckViewFits(const FieldPath& path, const ViewSpec& view, const ClothList& cloths);

}  // namespace drape::api

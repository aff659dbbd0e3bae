// What a cloth goes on from besides its particles, in and out of messages. Pure.
#pragma once

#include "drape/v1/snapshot_file.pb.h"
#include "server/api/field_checks.h"
#include "server/scheduler/cloth_runtime.h"
#include "server/solver/scalar_type.h"

namespace drape::api {

v1::RuntimeSnapshot RuntimeMessage(const RuntimeState& state);

// The cloth that a RuntimeSnapshot is of.
struct RuntimeOwner {
  const SceneModel& model;
  const ClothParameters& on_device;  // OnDevice
  ScalarType scalar;                 // of this server
};

// Meaningless after a violation. What could not come from SaveStates of such a cloth is one.
RuntimeState CheckRuntime(const FieldPath& path, const v1::RuntimeSnapshot& message,
                          const RuntimeOwner& owner, Violations& violations);

// [rows, 3] of a column, and back. A column of a message that CheckPackedRows has passed.
void FillColumn(const ScalarColumn& column, size_t first_row, size_t rows, v1::PackedArray* array);
ScalarColumn ToColumn(const v1::PackedArray& array);

}  // namespace drape::api

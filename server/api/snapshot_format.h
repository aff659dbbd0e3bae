// The version of the bytes of snapshots.
#pragma once

#include <cstdint>

namespace drape::api {

// Raised with every change that makes an older server misread them.
inline constexpr uint32_t kSnapshotVersion = 1;

}  // namespace drape::api

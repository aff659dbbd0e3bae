// Limits of one session and of all sessions together.
#pragma once

#include <cstddef>
#include <cstdint>

#include "server/session/request_memory.h"
#include "server/session/tenant_quota.h"

namespace drape {

struct SessionLimits {
  uint32_t max_sessions = 1024;
  TenantLimits per_tenant;
  uint32_t max_cloths_per_session = 65536;
  uint64_t max_particles_per_session = uint64_t{1} << 26;  // 67 million
  // States of the cloths of all sessions, as StateBytes counts them; 0: they are not in the memory
  // of the process, and the device says when it is full.
  uint64_t max_state_bytes = uint64_t{16} << 30;
  // Distance maps of colliders and their meshes, equal ones once: about 16 of the largest.
  uint64_t max_mesh_collider_bytes_per_session = uint64_t{256} << 20;
  // Of all sessions, equal ones of an owner once; a session, or a tenant, may have half.
  uint64_t max_mesh_collider_bytes = uint64_t{4} << 30;
  // Scene models, equal ones of an owner once, with the backend's copy of them, their descriptions,
  // colliders and driven rest lengths: of all sessions; a session, or a tenant, may have half.
  uint64_t max_model_bytes = uint64_t{8} << 30;
  // Per session; and of all sessions together the answers, of which a session, or a tenant, may
  // have a quarter, and the ids, of which it may have half.
  RequestMemoryLimits requests;
  uint64_t max_remembered_bytes = uint64_t{1} << 30;
  uint64_t max_request_id_bytes = uint64_t{2} << 30;
  // States kept by name (SaveStates), of all sessions; a session, or a tenant, may have a quarter.
  uint64_t max_saved_bytes = uint64_t{4} << 30;
  // Names that still answer SESSION_EXPIRED or SESSION_LOST; older ones are SESSION_NOT_FOUND.
  uint32_t max_ended_names = 4096;
};

// All cloths of a world are stepped as one piece of work.
inline constexpr size_t kMaxClothsPerWorld = 1024;
// Legal length of a world's name [bytes].
inline constexpr size_t kMaxWorldNameBytes = 256;

// Legal range and default of a lease [s].
inline constexpr double kMinTtl_s = 1;
inline constexpr double kMaxTtl_s = 86400;
inline constexpr double kDefaultTtl_s = 300;

// Legal length of a display name [bytes].
inline constexpr size_t kMaxDisplayNameBytes = 256;

// Items per page if a list request does not say, and the maximum.
inline constexpr uint32_t kDefaultPageSize = 100;
inline constexpr uint32_t kMaxPageSize = 1000;

}  // namespace drape

// Limits that requests are checked against before any work. Published by GetServerInfo.
#pragma once

#include <cstdint>

#include "server/scene/closed_mesh.h"
#include "server/scene/scene_model.h"
#include "server/session/session_limits.h"

namespace drape::api {

struct RequestLimits {
  // Lease of a session whose creator asks for none [s].
  double default_ttl_s = kDefaultTtl_s;
  // Larger messages are refused by the transport [bytes].
  uint32_t max_request_bytes = 64u << 20;
  // Requests that would take more memory than this once they are parsed are refused [bytes]: many
  // empty parts take a hundred times their bytes.
  uint64_t max_parsed_bytes() const { return 8 * uint64_t{max_request_bytes}; }
  // State data in one streamed message [bytes]. One callback stream is fastest at 1 MiB.
  uint32_t max_chunk_bytes = 1u << 20;
  // State data in a Step answer [bytes]; more must be read with ReadStates.
  uint64_t max_step_state_bytes = 64u << 20;
  // Requests that are being worked on and answers that their clients have not read [bytes]: of all
  // sessions, and of one session, which may exceed it by a single request or answer.
  uint64_t max_unread_bytes = uint64_t{2} << 30;
  uint64_t max_unread_bytes_per_session = uint64_t{256} << 20;
  // Open StepStream, StreamStates, Run and ImportCloths calls of all; a tenant has at most as many
  // as it leaves free. An idle one takes about 18 kB (by hand).
  uint32_t max_streams = 4096;
  // Limits of the model of one cloth.
  ModelLimits model;
  // Each particle meets every collider in every sweep.
  uint32_t max_colliders_per_cloth = 256;
  // Each takes seconds to build.
  uint32_t max_mesh_colliders_per_cloth = 16;
  // Colliders with a mass: each meets every particle and every other collider, one after the other.
  uint32_t max_bodies_per_cloth = 16;
  ClosedMeshLimits collider_mesh;
  uint32_t max_cloths_per_request = 65536;
  // Copies times colliders: bounds the memory that a small request can ask for.
  uint32_t max_colliders_per_request = 1u << 20;
  // StepStream: requests of one stream under way before the server stops reading from it.
  uint32_t max_pipelined_steps = 16;
};

}  // namespace drape::api

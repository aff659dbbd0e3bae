// Limits that requests are checked against before any work. Published by GetServerInfo.
#pragma once

#include <cstdint>

#include "server/scene/scene_model.h"

namespace drape::api {

struct RequestLimits {
  // Larger messages are refused by the transport [bytes].
  uint32_t max_request_bytes = 64u << 20;
  // Of state data in one streamed message [bytes]. One callback stream is fastest at 1 MiB.
  uint32_t max_chunk_bytes = 1u << 20;
  // Of state data in a Step answer [bytes]; more must be read with ReadStates.
  uint64_t max_step_state_bytes = 64u << 20;
  ModelLimits model;
  // Each particle meets every collider in every sweep.
  uint32_t max_colliders_per_cloth = 256;
  uint32_t max_cloths_per_request = 16384;
  // Of one Step; a longer run is several requests.
  uint32_t max_steps_per_request = 100'000;
  // StepStream: requests of one stream under way before the server stops reading from it.
  uint32_t max_pipelined_steps = 16;
  uint32_t max_page_size = 1000;
  uint32_t default_page_size = 100;
  // Of request_id, display_name and page_token.
  uint32_t max_text_bytes = 256;
};

}  // namespace drape::api

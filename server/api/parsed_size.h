// What a message takes in memory, told from its bytes before it is parsed.
#pragma once

#include <google/protobuf/descriptor.h>
#include <google/protobuf/io/zero_copy_stream.h>

#include <cstdint>

#include "server/core/status.h"

namespace drape::api {

// An upper estimate of the memory that a message of `type` takes once it is parsed [bytes]: with
// its sub-messages, of which each takes a hundred times the two bytes that an empty one has on the
// wire, and with the fields that the type does not know. Reads no more once it is above
// `enough_bytes`. Bytes that are no message count up to where they end to be one. Any thread.
uint64_t ParsedSize_bytes(const google::protobuf::Descriptor& type,
                          google::protobuf::io::ZeroCopyInputStream& bytes, uint64_t enough_bytes);

// RESOURCE_EXHAUSTED (REQUEST_TOO_LARGE).
Status RequestTooLarge(uint64_t most_bytes);

}  // namespace drape::api

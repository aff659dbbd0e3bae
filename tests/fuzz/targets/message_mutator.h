// Random changes of messages, field by field: bytes changed at random rarely reach what lies deep.
#pragma once

#include <google/protobuf/message.h>

#include <cstdint>

namespace drape::test {

// One to four changes: a field is set to a number that causes surprises, cleared, repeated, moved
// within its list, or a field of one of its messages is changed so.
void MutateMessage(google::protobuf::Message& message, uint32_t seed);

}  // namespace drape::test

// Messages that were written in slices, as their readers see them.
#pragma once

#include <google/protobuf/util/message_differencer.h>
#include <gtest/gtest.h>

#include <string>

#include "server/api/message_slices.h"
#include "server/api/state_chunks.h"

namespace drape::test {

inline std::string Joined(const api::MessageSlices& message) {
  std::string bytes;
  for (const grpc::Slice& slice : message) {
    bytes.append(reinterpret_cast<const char*>(slice.begin()), slice.size());
  }
  return bytes;
}

// The default message, and a failure, if the bytes are none or have fields that the type does not.
template <class Message>
Message Parsed(const api::MessageSlices& slices) {
  const std::string bytes = Joined(slices);
  Message message;
  EXPECT_TRUE(message.ParseFromString(bytes)) << Message::descriptor()->full_name();
  EXPECT_EQ(message.ByteSizeLong(), bytes.size()) << "as long as if protobuf had written it";
  return message;
}

inline v1::StateChunk NextChunk(api::StateChunker& chunker) {
  return Parsed<v1::StateChunk>(chunker.Next());
}

}  // namespace drape::test

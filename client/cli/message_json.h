// Answers of the server as JSON.
#pragma once

#include <google/protobuf/message.h>

#include <string>

namespace drape::cli {

// The protobuf JSON mapping with snake_case names, every scalar field written; 64-bit numbers are
// strings, as that mapping has them. Indented unless `is_line`.
std::string MessageJson(const google::protobuf::Message& message, bool is_line = false);

// "[a, b, ...]" of messages, one per line.
template <class Messages>
std::string MessagesJson(const Messages& messages) {
  std::string text = "[";
  for (const auto& message : messages) {
    text += (text.size() == 1 ? "\n" : ",\n") + MessageJson(message, /*is_line=*/true);
  }
  return text + "\n]";
}

}  // namespace drape::cli

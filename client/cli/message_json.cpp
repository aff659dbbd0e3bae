#include "client/cli/message_json.h"

#include <google/protobuf/util/json_util.h>

#include <stdexcept>

namespace drape::cli {

std::string MessageJson(const google::protobuf::Message& message, bool is_line) {
  google::protobuf::util::JsonPrintOptions options;
  options.add_whitespace = !is_line;
  options.always_print_primitive_fields = true;
  options.preserve_proto_field_names = true;
  std::string text;
  const auto status = google::protobuf::util::MessageToJsonString(message, &text, options);
  if (!status.ok()) throw std::runtime_error(status.ToString());
  return text;
}

}  // namespace drape::cli

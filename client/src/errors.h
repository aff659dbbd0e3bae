// Makes drape::Error from a gRPC status, and for failures on this side of the wire.
#pragma once

#include <grpcpp/support/status.h>

#include <cstdint>
#include <string>

#include "drape/error.h"

namespace drape {
inline namespace client {

// Decodes the google.rpc.Status of the trailing metadata. A status without details, or with details
// that do not parse, keeps its code and message. `status` must not be OK.
ErrorDetails DecodeStatus(const grpc::Status& status);

// Throws Error, or the class of its own that these details have.
[[noreturn]] void Throw(ErrorDetails details);

// Throws unless `status` is OK.
void ThrowIfFailed(const grpc::Status& status);

// Says how far the cloths of a session had come, if the session or a part of its past is lost.
// `told_step`: the highest step of the last answer; 0: none.
void AddLoss(uint64_t told_step, ErrorDetails* details);

// A failure found by the client itself.
Error LocalError(ErrorCode code, std::string reason, std::string message);

// kInvalidArgument, reason "BAD_FIELD", with one violation.
Error BadField(std::string field, std::string description);
// The error of a part of something larger: its fields are put below `path`; without fields, the
// message begins with "PATH: ".
Error Below(const std::string& path, const Error& error);

// The text of a number in messages: "-1e+308" rather than all its digits.
std::string NumberText(double value);

}  // namespace client
}  // namespace drape

// The messages of gRPC and protobuf in our log. By default both libraries write to stderr, protobuf
// once for every malformed message.
#pragma once

namespace drape::api {

// Their messages become debug lines, except those that make gRPC abort. Call once, before anything
// is served.
void TakeLibraryLogs();

}  // namespace drape::api

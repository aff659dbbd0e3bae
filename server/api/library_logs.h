// gRPC and protobuf write to stderr on their own, protobuf once for every hostile message: here
// they are made part of our log.
#pragma once

namespace drape::api {

// Their messages become debug lines, except those that make gRPC abort. Call once, before anything
// is served.
void TakeLibraryLogs();

}  // namespace drape::api

// Reading the certificate and the key that a server was told to use.
#pragma once

#include <string>

#include "server/api/grpc_server.h"

namespace drape::api {

// Fills the PEM texts of `options`; two empty names leave them empty. FAILED_PRECONDITION
// (TLS_FILE_FAILED) names a file that cannot be read or is empty: a server that was told to encrypt
// never serves in the clear.
Status ReadTlsFiles(const std::string& cert_file, const std::string& key_file,
                    ServerOptions& options);

}  // namespace drape::api

// A library that nobody asked for: being loaded is enough for it to leave a file behind.
#include <cstdio>
#include <cstdlib>

namespace {

__attribute__((constructor)) void leave_proof() {
    const char* proof = std::getenv("CLERESTORY_HOSTILE_PROOF");
    if (proof == nullptr) return;
    if (std::FILE* file = std::fopen(proof, "w")) std::fclose(file);
}

}  // namespace

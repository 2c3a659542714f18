#pragma once

/// What the shared library offers; everything else in it stays hidden.
#define CLERESTORY_API __attribute__((visibility("default")))

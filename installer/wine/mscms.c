/* For tests only: Qt asks for the screen's colour profile, at which Wine ends the
   process. This says that there is none. */
#define EXPORT __declspec(dllexport)

EXPORT void *OpenColorProfileW(void *a, unsigned b, unsigned c, unsigned d) { return 0; }
EXPORT void *OpenColorProfileA(void *a, unsigned b, unsigned c, unsigned d) { return 0; }
EXPORT int CloseColorProfile(void *profile) { return 1; }
EXPORT int GetColorProfileFromHandle(void *a, void *b, void *c) { return 0; }
EXPORT void *WcsCreateIccProfile(void *profile, unsigned options) { return 0; }

int __stdcall DllMainCRTStartup(void *library, unsigned reason, void *more) { return 1; }

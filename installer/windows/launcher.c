/* Starts the bundled CPython within its own process, so that task manager, taskbar and
   file association show Lightpen with its own icon.

   Lightpen.exe has no console; with CONSOLE defined it is bin\lightpen.exe, for use in a
   terminal. Both take the runtime beside Lightpen.exe and nothing from elsewhere. */
#define WIN32_LEAN_AND_MEAN
#include <windows.h>
#include <stdio.h>
#include <stdlib.h>
#include <wchar.h>

#define LONGEST 32768 /* letters of a path */
#define DAMAGED 3     /* exit status */

typedef int (*Main)(int, wchar_t **);

static int complain(const wchar_t *what)
{
    static wchar_t text[2048];
    unsigned long error = GetLastError();

    _snwprintf(text, 2047,
               L"Lightpen cannot start: %ls is missing or damaged (Windows error %lu). "
               L"Install Lightpen again.",
               what, error);
#ifdef CONSOLE
    fwprintf(stderr, L"%ls\n", text);
#else
    if (!GetEnvironmentVariableW(L"LIGHTPEN_NO_DIALOG", NULL, 0))
        MessageBoxW(NULL, text, L"Lightpen", MB_ICONERROR | MB_OK);
#endif
    return DAMAGED;
}

static void cut_last(wchar_t *path)
{
    wchar_t *slash = wcsrchr(path, L'\\');
    if (slash)
        *slash = 0;
}

static int start(int count, wchar_t **words)
{
    static wchar_t folder[LONGEST], library[LONGEST], script[LONGEST];
    wchar_t **given;
    HMODULE python;
    Main run;
    DWORD length;
    int i, n = 0;

    length = GetModuleFileNameW(NULL, folder, LONGEST - 64);
    if (!length || length >= LONGEST - 64)
        return complain(L"its folder");
    cut_last(folder);
#ifdef CONSOLE
    cut_last(folder);
#endif
    /* Libraries are taken from our own folders: not from the current one, nor PATH. */
    SetDllDirectoryW(L"");
    _snwprintf(library, LONGEST - 1, L"%ls\\runtime\\" PYTHON, folder);
    python = LoadLibraryExW(library, NULL, LOAD_WITH_ALTERED_SEARCH_PATH);
    if (!python)
        return complain(L"runtime\\" PYTHON);
    run = (Main)(void *)GetProcAddress(python, "Py_Main");
    if (!run)
        return complain(L"runtime\\" PYTHON);
    _snwprintf(script, LONGEST - 1, L"%ls\\start.py", folder);
    given = calloc((size_t)count + 8, sizeof *given);
    if (!given)
        return complain(L"memory");
    given[n++] = words[0];
    given[n++] = L"-I"; /* isolated from the user's other Pythons */
    given[n++] = L"-X";
    given[n++] = L"utf8";
    given[n++] = script;
    for (i = 1; i < count; i++)
        given[n++] = words[i];
    return run(n, given);
}

#ifdef CONSOLE
int wmain(int count, wchar_t **words)
{
    return start(count, words);
}
#else
int WINAPI wWinMain(HINSTANCE instance, HINSTANCE before, LPWSTR line, int show)
{
    (void)instance, (void)before, (void)line, (void)show;
    return start(__argc, __wargv);
}
#endif

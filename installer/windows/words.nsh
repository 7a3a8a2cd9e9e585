; What installer and uninstaller say.

!macro Words name english chinese
  LangString ${name} ${LANG_ENGLISH} "${english}"
  LangString ${name} ${LANG_SIMPCHINESE} "${chinese}"
!macroend
!define Words "!insertmacro Words"

${Words} PROGRAM "${NAME} (required)" "${NAME}（必需）"
${Words} PROGRAM_ABOUT \
  "The program, its start menu entry, and the opening of recorded swings." \
  "程序本身、开始菜单项，以及摆动记录的文件关联。"
${Words} DESKTOP_ICON "Icon on the desktop" "桌面图标"
${Words} DESKTOP_ABOUT "An icon on the desktop that starts ${NAME}." "在桌面上放置启动 ${NAME} 的图标。"
${Words} CONSOLE "${NAME} command line" "${NAME} 命令行"
${Words} SWING_FILE "${NAME} swing" "${NAME} 摆动记录"
${Words} RESULT_FILE "${NAME} result" "${NAME} 标定结果"
${Words} OLD_WINDOWS \
  "${NAME} needs Windows 10 (version 1809) or later." \
  "${NAME} 需要 Windows 10（版本 1809）或更高版本。"
${Words} NOT_64_BIT "${NAME} needs a 64-bit Windows." "${NAME} 需要 64 位 Windows。"
${Words} IS_RUNNING \
  "${NAME} is running. Close it, then choose Retry." \
  "${NAME} 正在运行。请先关闭它，再点“重试”。"
${Words} IS_NEWER \
  "${NAME} $0 is installed, which is newer. Replace it with ${VERSION}?" \
  "已安装更新的版本 ${NAME} $0。要用 ${VERSION} 替换它吗？"
${Words} IS_FOREIGN \
  "The folder $INSTDIR is not empty and was not made by ${NAME}. Choose another folder; nothing was changed." \
  "文件夹 $INSTDIR 不是空的，也不是 ${NAME} 创建的。请选择其他文件夹；未作任何更改。"
${Words} NO_RIGHT \
  "$INSTDIR cannot be written. Choose another folder, or ask for access to this one." \
  "无法写入 $INSTDIR。请选择其他文件夹，或申请该文件夹的写入权限。"
${Words} NO_SPACE \
  "There are $1 MB free for $INSTDIR, and $2 MB are needed. Free some space, or choose another disk; nothing was changed." \
  "$INSTDIR 所在磁盘剩余 $1 MB，需要 $2 MB。请清理空间或选择其他磁盘；未作任何更改。"
${Words} NOT_WRITTEN \
  "Not all files could be written to $INSTDIR. Make sure that the disk is not full and no other program holds them, then run this installer again: it repairs what is there." \
  "未能将全部文件写入 $INSTDIR。请确认磁盘未满、且没有其他程序占用这些文件，然后重新运行安装程序：它会修复现有内容。"
${Words} NO_ADMINISTRATOR \
  "The installation for all users takes the rights of an administrator. Start it as administrator; nothing was changed." \
  "为所有用户安装需要管理员权限。请以管理员身份运行；未作任何更改。"
${Words} NOT_INSTALLED "$INSTDIR does not hold ${NAME}." "$INSTDIR 中没有安装 ${NAME}。"
